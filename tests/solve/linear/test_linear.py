"""ms.linear_response and ms.linear_buckling: against nonlinear solves, and bad input."""

import numpy as np
import pytest

import magshell as ms

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 0.1, 0.01, 5e-4, 1e6
EULER = np.pi**2 / 48 * YOUNG_MODULUS * THICKNESS**3 / LENGTH**2  # of a cantilever, N/m


def strip(**sheet) -> tuple[ms.TriangleMesh, ms.Shell]:
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=(20, 2))
    material = {"thickness": THICKNESS, "young_modulus": YOUNG_MODULUS, "poisson_ratio": 0.0}
    return mesh, ms.Shell(mesh, **{**material, **sheet})


def compressed(force: float, **sheet) -> ms.Scene:
    mesh, shell = strip(**sheet)
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (-force, 0, 0))
    return ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])


def magnetic() -> ms.Scene:
    mesh, shell = strip()
    return ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


@pytest.mark.parametrize("bending", ["midedge", "hinge"])
def test_response_is_the_limit_of_small_equilibria(bending: str) -> None:
    mesh, shell = strip(bending=bending, mass_density=1e3)
    support = ms.Clamp(mesh.edges_at(x=0.0), displacement=(0, 0, 0.01), rotation=(0, 0.2, 0))
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (0.01, 0, 1e-4))
    scene = ms.Scene(shell, supports=[support], loads=[load], gravity=(0, 0, -0.1), field=ms.UniformField())
    field = {"remanent_magnetization": (4e4, 0, 0), "applied_flux_density": np.array([0, 1e-6, 1e-5])}
    response = ms.linear_response(scene, **field)
    small = 1e-3

    def state(t: float) -> ms.Equilibrium:
        factors = dict.fromkeys(("load_factor", "gravity_factor", "support_factor"), t)
        return ms.equilibrium(
            scene, **{**field, "applied_flux_density": t * field["applied_flux_density"]}, **factors
        )

    up, down = state(small), state(-small)
    for found, expected in (
        (up.positions - down.positions, response.displacements),
        (up.edge_rotations - down.edge_rotations, response.edge_rotations),
    ):
        np.testing.assert_allclose(found / (2 * small), expected, atol=1e-4 * np.abs(expected).max() + 1e-9)
    assert response.factorizations == 1 and "largest displacement" in repr(response)


def test_response_is_proportional() -> None:
    scene = magnetic()
    magnetization = np.tile([4e4, 0, 0], (scene.mesh.n_faces, 1))
    once, twice = (
        ms.linear_response(
            scene, remanent_magnetization=magnetization, applied_flux_density=(0, 0, b)
        ).displacements
        for b in (1e-3, 2e-3)
    )
    np.testing.assert_allclose(twice, 2 * once, rtol=1e-12, atol=0)


def test_response_of_tensors_is_a_tensor() -> None:
    torch = pytest.importorskip("torch")
    field = torch.tensor([0.0, 0.0, 1e-3], dtype=torch.float64)
    response = ms.linear_response(magnetic(), remanent_magnetization=(4e4, 0, 0), applied_flux_density=field)
    assert isinstance(response.displacements, torch.Tensor)
    rest = torch.tensor(np.array(response.scene.mesh.rest_positions))
    assert torch.equal(response.positions, rest + response.displacements)


def test_buckling_load_and_mode() -> None:
    found = ms.linear_buckling(compressed(EULER), modes=2)
    np.testing.assert_allclose(found.factors, [1.0, 9.0], rtol=0.02)
    mesh = found.scene.mesh
    x = mesh.rest_positions[:, 0]
    np.testing.assert_allclose(found.modes[0][:, 2], 1 - np.cos(np.pi * x / (2 * LENGTH)), atol=0.01)
    assert found.modes.shape == (2, mesh.n_vertices, 3) and found.edge_rotations.shape == (2, mesh.n_edges)
    assert np.abs(found.modes).max(axis=(1, 2)) == pytest.approx([1.0, 1.0])
    assert "Buckling: at " in repr(found)


def test_buckling_is_where_the_path_branches() -> None:
    scene = compressed(2 * EULER)
    branch = ms.follow_path(scene, progress=False).critical[0]
    assert branch.kind == "bifurcation"
    assert ms.linear_buckling(scene).factors[0] == pytest.approx(branch.parameter, rel=1e-3)


def test_buckling_by_motion() -> None:
    mesh, shell = strip()
    shortening = np.pi**2 / 3 * THICKNESS**2 / LENGTH  # of a column clamped at both ends, as it buckles
    far = ms.Clamp(mesh.edges_at(x=LENGTH), displacement=(-shortening, 0, 0))
    scene = ms.Scene(shell, supports=[ms.Clamp(mesh.edges_at(x=0.0)), far])
    assert ms.linear_buckling(scene).factors[0] == pytest.approx(1.0, rel=0.03)
    assert ms.linear_buckling(scene, support_factor=0.5).factors[0] == pytest.approx(2.0, rel=0.03)


@pytest.mark.parametrize("direction", [(-1, 0, 0), (0, 0, -1)])
def test_buckling_in_a_field(direction) -> None:
    # Magnetised along it, against the field: M B h L^2 = (pi^2 / 4) D. Magnetised across, no force acts
    # before it buckles, but the energy of a small rotation is the same.
    magnetization = 1e5 * -np.array(direction)
    stiffness = YOUNG_MODULUS * THICKNESS**3 / 12
    flux_density = np.pi**2 / 4 * stiffness / (1e5 * THICKNESS * LENGTH**2)
    found = ms.linear_buckling(
        magnetic(),
        remanent_magnetization=magnetization,
        applied_flux_density=flux_density * np.array(direction),
    )
    assert found.factors[0] == pytest.approx(1.0, rel=0.01)


def test_a_pulled_strip_does_not_buckle() -> None:
    with pytest.raises(ValueError, match="nothing buckles under these load parameters"):
        ms.linear_buckling(compressed(-EULER))


def test_buckling_without_a_load_is_refused() -> None:
    with pytest.raises(ValueError, match="neither load the scene"):
        ms.linear_buckling(compressed(EULER), load_factor=0.0)


@pytest.mark.parametrize("modes", [0, -1, 1.5, True, "two"])
def test_modes_must_be_a_positive_integer(modes) -> None:
    with pytest.raises(ValueError, match="modes must be an integer of at least 1"):
        ms.linear_buckling(compressed(EULER), modes=modes)


def test_not_more_modes_than_unknowns() -> None:
    scene = compressed(EULER)
    with pytest.raises(ValueError, match=f"below the {scene.n_dofs} free degrees of freedom"):
        ms.linear_buckling(scene, modes=scene.n_dofs)


@pytest.mark.parametrize("function", [ms.linear_response, ms.linear_buckling])
def test_bad_input_is_refused(function) -> None:
    with pytest.raises(ValueError, match="scene must be a Scene"):
        function("scene")
    with pytest.raises(ValueError, match="remanent_magnetization"):
        function(magnetic(), applied_flux_density=(0, 0, 1e-3))
    with pytest.raises(ValueError, match="load_factor"):
        function(compressed(EULER), load_factor=np.nan)


@pytest.mark.parametrize("function", [ms.linear_response, ms.linear_buckling])
def test_a_sheet_that_floats(function) -> None:
    scene = ms.Scene(strip()[1], loads=[ms.PointLoad(0, (0, 0, 1))], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="not positive definite"):
        function(scene)
