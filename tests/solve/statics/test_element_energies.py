"""Energies of single faces and tetrahedra: their sums, their places, closed forms, and what has none."""

import numpy as np
import pytest

import magshell as ms

MESH = ms.meshes.rectangle(0.04, 0.02, cells=(6, 3))
RUBBER = {"thickness": 1e-3, "young_modulus": 1e6, "poisson_ratio": 0.3, "mass_density": 1e3}
GIVEN = {"remanent_magnetization": (3e4, 1e3, 2e4), "applied_flux_density": (1e-3, 2e-3, 5e-3)}


def bent(mesh):
    x, y, z = mesh.rest_positions.T
    return np.stack([1.01 * x, y + 0.1 * x, z + 0.1 * x * np.sin(60 * x + 20 * y)], 1)


def shell_scene(mesh=MESH, field=None, **options):
    sheet = ms.Shell(mesh, **{**RUBBER, **options})
    clamp = ms.Clamp(mesh.edges_at(x=0.0))
    return ms.Scene(sheet, supports=[clamp], gravity=(0, 0, -9.81), field=field or ms.UniformField())


SHELLS = {
    "hinge": lambda: shell_scene(bending="hinge"),
    "midedge": lambda: shell_scene(bending="midedge"),
    "half of the curvature": lambda: shell_scene(curvature_scale=0.5),
    "thickness of each face": lambda: shell_scene(thickness=1e-3 * np.linspace(0.5, 1.5, MESH.n_faces)),
    "six-node": lambda: shell_scene(ms.meshes.rectangle(0.04, 0.02, cells=(4, 2), order=2)),
    "rotating magnetization": lambda: shell_scene(magnetization_law="rotates"),
}


@pytest.mark.parametrize("name", SHELLS)
def test_energies_of_faces_add_up_to_those_of_the_sheet(name):
    scene = SHELLS[name]()
    positions = bent(scene.mesh)
    rotations = 0.02 * np.random.default_rng(1).normal(size=scene._bodies.n_rotations)
    whole = ms.energies(scene, positions, edge_rotations=rotations, **GIVEN)
    found = ms.energies(scene, positions, edge_rotations=rotations, by="face", **GIVEN)
    assert set(found) == {"membrane", "bending", "magnetic"}
    for kind, energies in found.items():
        assert energies.shape == (getattr(scene.mesh, "n_elements", scene.mesh.n_faces),)
        assert energies.sum() == pytest.approx(whole[kind], rel=1e-11, abs=1e-13 * np.abs(energies).sum()), (
            kind
        )
        assert np.ptp(energies) > 0.0
    assert found["membrane"].min() >= 0.0 and found["bending"].min() >= 0.0


def test_faces_near_a_magnet_that_sample_finely_add_up():
    size, place = (0.01, 0.01, 0.005), (0.02, 0.01, -0.004)
    magnet = ms.CuboidMagnet(size, remanent_magnetization=(0, 0, 1e6), center=place)
    scene = shell_scene(field=magnet)
    given = {"remanent_magnetization": (3e4, 1e3, 2e4)}
    whole = ms.energies(scene, MESH.rest_positions, **given)["magnetic"]
    found = ms.energies(scene, MESH.rest_positions, by="face", **given)["magnetic"]
    assert found.sum() == pytest.approx(whole, rel=1e-11)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("material", [ms.NeoHookean, ms.StVenantKirchhoff])
def test_energies_of_tetrahedra_add_up_to_those_of_the_solid(order, material):
    rubber, magnetization = material(young_modulus=1e5, poisson_ratio=0.3), (3e4, 1e3, 2e4)
    mesh = ms.meshes.box((0.02, 0.01, 0.01), cells=(3, 2, 2), order=order)
    block = ms.Solid(mesh, material=rubber, mass_density=1e3, remanent_magnetization=magnetization)
    pin = ms.Pin(block.mesh.vertices_at(x=0.0))
    scene = ms.Scene(block, supports=[pin], gravity=(0, 0, -9.81), field=ms.UniformField())
    positions, given = bent(block.mesh), {"applied_flux_density": (1e-3, 2e-3, 5e-3)}
    whole = ms.energies(scene, positions, **given)
    found = ms.energies(scene, positions, by="tetrahedron", **given)
    assert set(found) == {"solid", "magnetic"}
    for kind, energies in found.items():
        assert energies.shape == (mesh.n_tetrahedra,)
        assert energies.sum() == pytest.approx(whole[kind], rel=1e-11, abs=1e-13 * np.abs(energies).sum()), (
            kind
        )


def test_stretched_faces_have_the_energies_of_their_strains():
    """Check one face after another of a sheet whose strain grows along it, against E h A e^2 / 2 of Green's strain e."""
    mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))])
    x = mesh.rest_positions[:, 0]
    positions = mesh.rest_positions + np.stack([x**2, 0 * x, 0 * x], 1)
    found = ms.energies(scene, positions, by="face")
    ends = np.sort(x[mesh.faces], axis=1)
    stretch = 1.0 + ends[:, 0] + ends[:, 2]
    wanted = 0.5 * 1e6 * 1e-3 * mesh.face_areas * (0.5 * (stretch**2 - 1.0)) ** 2
    np.testing.assert_allclose(found["membrane"], wanted, rtol=1e-10)
    np.testing.assert_allclose(found["bending"], 0.0, atol=1e-18)


def test_a_bent_corner_has_its_energy_in_the_faces_beside_it():
    scene = shell_scene(bending="hinge")
    x, y, _ = MESH.rest_positions.T
    positions = np.stack([x, y, np.maximum(x - 0.02, 0.0)], 1)
    found = ms.energies(scene, positions, by="face", **GIVEN)["bending"]
    beside = (np.abs(x[MESH.faces] - 0.02) < 1e-12).any(axis=1)
    assert found[~beside].max() < 1e-12 * found.max()
    assert (np.flatnonzero(found > 1e-6 * found.max()).size) > 0


def test_bodies_of_a_scene_have_their_own_faces():
    sheets = [
        ms.Shell(MESH.transformed(translation=(0, 0, 0.01 * k)), **{**RUBBER, "young_modulus": 1e6 * (k + 1)})
        for k in range(2)
    ]
    mesh = ms.meshes.box((0.02, 0.01, 0.01), cells=(2, 1, 1)).transformed(translation=(0, 0, 0.05))
    block = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.3), mass_density=1e3)
    scene = ms.Scene([*sheets, block], allow_rigid_motions=True)
    positions = 1.01 * scene.mesh.rest_positions
    first, second = (ms.energies(scene, positions, by="face", body=sheet) for sheet in sheets)
    np.testing.assert_allclose(second["membrane"], 2.0 * first["membrane"], rtol=1e-10)
    for body, by in ((sheets[1], "face"), (block, "tetrahedron")):
        found, whole = (ms.energies(scene, positions, body=body, **each) for each in ({"by": by}, {}))
        for name, energy in whole.items():
            assert found[name].sum() == pytest.approx(energy, rel=1e-10, abs=1e-18)
    with pytest.raises(ValueError, match="the scene has 2 bodies with energies by face: choose one"):
        ms.energies(scene, positions, by="face")
    with pytest.raises(ValueError, match="a Solid has no energies by face"):
        ms.energies(scene, positions, by="face", body=block)
    with pytest.raises(ValueError, match=r"a body of the scene is one of scene\.bodies"):
        ms.energies(scene, positions, by="face", body=ms.Shell(MESH, **RUBBER))


def test_faces_have_no_gradients_and_bad_input_is_named():
    torch = pytest.importorskip("torch")
    scene = shell_scene()
    positions = torch.tensor(bent(MESH), requires_grad=True)
    with pytest.raises(ms.NoGradient, match="energies by face have no gradients"):
        ms.energies(scene, positions, by="face", **GIVEN)
    assert ms.energies(scene, positions.detach(), by="face", **GIVEN)["membrane"].shape == (MESH.n_faces,)
    for by in ("edge", 3, ["face"]):
        with pytest.raises(ValueError, match='by must be "face" or "tetrahedron"'):
            ms.energies(scene, MESH.rest_positions, by=by, **GIVEN)
    with pytest.raises(ValueError, match="the scene has 0 bodies with energies by tetrahedron"):
        ms.energies(scene, MESH.rest_positions, by="tetrahedron", **GIVEN)
