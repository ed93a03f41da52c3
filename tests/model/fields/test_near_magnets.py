"""Shells near magnets: their faces sample the field finely, in their plane and through their thickness."""

import pickle

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms
from magshell.model.scene.field_sampling import sampling_errors
from magshell.model.scene.fine_faces import fine_faces

WIDTH, THICKNESS, POLARIZATION = 10e-3, 0.2e-3, 0.0754
MAGNETIZATION = POLARIZATION / VACUUM_PERMEABILITY


def plate_at_magnet(cells, gap, *, shift=0.0, law="stretches", young_modulus=1e6, normal=True, **scene):
    """Return a scene of a plate above a magnet of its size, gap [m] apart, both magnetized along z or along x."""
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(cells, cells))
    mesh = mesh.transformed(translation=(shift - WIDTH / 2, shift - WIDTH / 2, gap + THICKNESS))
    along = MAGNETIZATION * np.array([0.0, 0.0, 1.0] if normal else [1.0, 0.0, 0.0])
    magnet = ms.CuboidMagnet((WIDTH, WIDTH, THICKNESS), remanent_magnetization=along)
    plate = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=young_modulus,
        poisson_ratio=0.3,
        mass_density=1e3,
        remanent_magnetization=along,
        magnetization_law=law,
    )
    return ms.Scene(plate, supports=[ms.Clamp(mesh.edges_at(x=shift - WIDTH / 2))], field=magnet, **scene)


def force(scene, positions=None) -> np.ndarray:
    """Return the magnetic force on all vertices [N]."""
    positions = scene.mesh.rest_positions if positions is None else positions
    return ms.forces(scene, positions).on_vertices.sum(axis=0)


@pytest.mark.parametrize(("cells", "gap"), [(16, 0.2e-3), (32, 0.2e-3), (16, 1e-3), (16, 0.5e-3)])
@pytest.mark.parametrize("law", ["stretches", "rotates"])
@pytest.mark.parametrize("normal", [True, False])
def test_the_force_of_a_near_magnet_is_right_to_0_1_percent(cells, gap, law, normal):
    size = (WIDTH, WIDTH, THICKNESS)
    exact = cuboid_force(size, size, (0, 0, gap + THICKNESS), 2 if normal else 0, POLARIZATION)
    found = force(plate_at_magnet(cells, gap, law=law, normal=normal))
    assert found == pytest.approx(exact, abs=1e-3 * np.linalg.norm(exact))


@pytest.mark.parametrize("cells", [16, 32])
@pytest.mark.parametrize("normal", [True, False])
def test_the_force_of_a_magnet_is_right_to_0_1_percent_at_every_distance(cells, normal):
    """Check gaps from a thickness to ten lengths. Faces sampled once up to an error of 1 %: 0.8 % was left at 1.5 mm."""
    size = (WIDTH, WIDTH, THICKNESS)
    off = {}
    for gap in (0.2e-3, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3, 5e-3, 10e-3, 30e-3, 100e-3):
        exact = cuboid_force(size, size, (0, 0, gap + THICKNESS), 2 if normal else 0, POLARIZATION)
        found = force(plate_at_magnet(cells, gap, normal=normal))
        off[gap] = np.linalg.norm(found - exact) / np.linalg.norm(exact)
    assert max(off.values()) < 1e-3, off


def strained(law, young_modulus=1e3):
    """Return a scene near a magnet, and positions, magnetization and a thickness, all different from face to face."""
    scene = plate_at_magnet(4, 0.3e-3, law=law, young_modulus=young_modulus)
    rng = np.random.default_rng(0)
    rest = scene.mesh.rest_positions
    return scene, {
        "positions": rest * [1.05, 0.97, 1.0] + 2e-5 * rng.normal(size=rest.shape),
        "remanent_magnetization": rng.normal(size=(scene.mesh.n_faces, 3)) * MAGNETIZATION,
        "thickness": THICKNESS * rng.uniform(0.8, 1.2, scene.mesh.n_faces),
    }


def slope(function, step):
    """Return a derivative at 0 by central differences of sixth order."""
    pairs = [(3 / 4, 1), (-3 / 20, 2), (1 / 60, 3)]
    return sum(c * (function(m * step) - function(-m * step)) for c, m in pairs) / step


@pytest.mark.parametrize("law", ["stretches", "rotates"])
def test_forces_and_hessian_products_of_fine_faces_agree_with_differences(law):
    torch = pytest.importorskip("torch")
    scene, given = strained(law)
    positions = given.pop("positions")
    rng = np.random.default_rng(1)
    forces = ms.forces(scene, positions, **given).on_vertices
    for _ in range(3):
        along = rng.normal(size=positions.shape)
        by_differences = slope(lambda t, d=along: ms.energy(scene, positions + t * d, **given), 2e-7)
        size = np.abs(forces * along).sum()
        assert -(forces * along).sum() == pytest.approx(by_differences, abs=1e-7 * size)
        x = torch.tensor(positions, requires_grad=True)
        (by_x,) = torch.autograd.grad(ms.energy(scene, x, **given), x, create_graph=True)
        (product,) = torch.autograd.grad((by_x * torch.from_numpy(along)).sum(), x)
        exact = -slope(lambda t, d=along: ms.forces(scene, positions + t * d, **given).on_vertices, 2e-7)
        assert product.numpy() == pytest.approx(exact, abs=1e-7 * np.abs(exact).max())


def test_faces_that_need_it_sample_finely_from_the_start_and_results_keep_them():
    scene = plate_at_magnet(16, 0.2e-3, young_modulus=1e10)
    found = ms.equilibrium(scene)
    fine = fine_faces(found._values)
    assert (
        0.5 * len(fine) < fine.sum() < len(fine)
    )  # not those above the middle of the magnet, where its field is even
    (left,) = sampling_errors(found._values, found.positions, 1.0, None)
    assert left.error < 1e-3
    assert found.log[0].method == "load step" and found.load_steps == 1
    copied = pickle.loads(pickle.dumps(found))
    assert np.array_equal(fine_faces(copied._values), fine)
    again = ms.equilibrium(scene, start=found)
    assert np.array_equal(fine_faces(again._values), fine)
    assert again.positions == pytest.approx(found.positions, abs=1e-12)


def test_a_start_of_another_scene_is_refused_by_name_where_faces_sample_finely():
    other = ms.equilibrium(plate_at_magnet(8, 0.2e-3, young_modulus=1e10))
    with pytest.raises(ValueError, match="equilibrium of another scene"):
        ms.equilibrium(plate_at_magnet(4, 0.2e-3, young_modulus=1e10), start=other)


@pytest.mark.parametrize("gap", [10e-3, 0.1])
def test_faces_far_from_a_magnet_sample_its_field_once(gap):
    assert not fine_faces(ms.equilibrium(plate_at_magnet(16, gap, young_modulus=1e9))._values).any()


@pytest.mark.parametrize("moment", [(0, 0, 1), (1, 0, 0), (1, 1, 1)])
@pytest.mark.parametrize("along", [(0, 0, 1), (1, 1, 0)])
def test_no_face_beyond_24_edges_from_a_dipole_samples_finely(moment, along):
    """Check that the error at 24 edges is not one that faces sample finely for."""
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(4, 4), diagonals="aligned")
    direction = np.array(along) / np.linalg.norm(along)
    nearest = (mesh.rest_positions @ direction).max() - WIDTH / 2 * direction[:2].sum()
    center = np.array([WIDTH / 2, WIDTH / 2, 0.0]) + (nearest + 24 * mesh.edge_lengths.max()) * direction
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=1e9, remanent_magnetization=np.array(moment) * 1e5
    )
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.Dipoles([center], [moment]))
    (found,) = sampling_errors(scene._values, mesh.rest_positions, 1.0, None)
    assert found.error < 0.001


def flap(young_modulus=2e7, **extra):
    """Return a scene of a flap 4 mm above a magnet, with a load on its tip of 1 N per unit load factor."""
    mesh = ms.meshes.rectangle(WIDTH, WIDTH / 2, cells=(8, 4))
    mesh = mesh.transformed(translation=(-WIDTH / 2, -WIDTH / 4, 4e-3 + THICKNESS))
    magnet = ms.CuboidMagnet((WIDTH, WIDTH, THICKNESS), remanent_magnetization=(0, 0, MAGNETIZATION))
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=young_modulus,
        mass_density=1e3,
        remanent_magnetization=(0, 0, MAGNETIZATION),
    )
    tip = ms.PointLoad(mesh.vertices_at(x=WIDTH / 2), (0, 0, -1.0))
    return ms.Scene(
        sheet, supports=[ms.Clamp(mesh.edges_at(x=-WIDTH / 2))], loads=[tip], field=magnet, **extra
    )


PUSH = 1.2e-4


def test_a_search_goes_on_with_fine_faces_where_the_sheet_comes_near_a_magnet():
    scene = flap()
    found = ms.equilibrium(scene, load_factor=PUSH)
    assert found.positions[:, 2].min() < 2e-3
    fine = fine_faces(found._values)
    assert 0 < fine.sum() < len(fine)
    assert sum(step.factorizations for step in found.log) == found.factorizations
    assert found.log[-1].load_fraction == 1.0 and found.load_fraction == 1.0
    (left,) = sampling_errors(found._values, found.positions, 1.0, None)
    assert left.error < 1e-3
    forces = ms.forces(scene, found.positions, edge_rotations=found.edge_rotations, load_factor=PUSH)
    inside = np.setdiff1d(np.arange(scene.mesh.n_vertices), scene.mesh.vertices_at(x=-WIDTH / 2))
    assert np.abs(forces.on_vertices[inside]).max() < 1e-2 * PUSH


def test_gradients_agree_with_differences_after_a_search_that_needed_more_fine_faces():
    torch = pytest.importorskip("torch")
    scene = flap()
    magnet, sheet = scene.fields[0], scene.bodies[0]
    exact = {"solver": ms.MixedNewton(tolerance=1e-13)}
    values = {
        magnet: {"center": np.array([1e-4, 2e-4, 1e-4])},
        sheet: {"thickness": np.full(sheet.mesh.n_faces, THICKNESS)},
    }
    given = {"load_factor": PUSH, **exact}
    start = ms.equilibrium(scene, values=values, **given)
    assert fine_faces(start._values).any()
    sizes = {magnet: {"center": 1e-4}, sheet: {"thickness": 1e-2 * THICKNESS}}

    def lowest(values, start):
        return ms.equilibrium(scene, values=values, start=start, **given).positions[-3:, 2].sum()

    tensors = {
        each: {name: torch.tensor(array, requires_grad=True) for name, array in named.items()}
        for each, named in values.items()
    }
    lowest(tensors, None).backward()
    rng = np.random.default_rng(3)
    for each, named in values.items():
        for name, array in named.items():
            along = sizes[each][name] * rng.normal(size=array.shape)

            def moved(t, each=each, name=name, array=array, along=along):
                return lowest({**values, each: {name: array + t * along}}, start)

            by = tensors[each][name].grad.numpy()
            assert (by * along).sum() == pytest.approx(
                slope(moved, 1e-2), abs=1e-6 * np.abs(by * along).sum()
            )


def test_a_path_keeps_the_fine_faces_of_its_start_and_warns_where_they_are_too_few():
    scene = flap()
    magnet = scene.fields[0]
    far = ms.equilibrium(scene, load_factor=0.0, values={magnet: {"center": (0, 0, -60e-3)}})
    near = {magnet: {"center": (0, 0, 0)}}
    with pytest.warns(ms.FieldSamplingWarning, match=r"the path, at point .* sample the field once each"):
        path = ms.follow_path(scene, start=far, values=near, load_factor=PUSH, max_step=0.1)
    assert not fine_faces(path._values_at(0)).any()
    start = ms.equilibrium(flap_scene := flap(), load_factor=PUSH)
    back = ms.follow_path(flap_scene, start=start, load_factor=0.9 * PUSH)
    assert np.array_equal(fine_faces(back._values_at(0)), fine_faces(start._values))


def test_a_motion_takes_fine_faces_where_the_magnet_comes_near():
    scene = flap(young_modulus=1e9)
    magnet = scene.fields[0]
    up = np.linspace(0.0, 3.2e-3, 5)[:, None] * (0.0, 0.0, 1.0)
    motion = ms.simulate(
        scene, steps=4, time_step=1e-6, load_factor=0.0, values={magnet: {"center": up}}, progress=False
    )
    fine = fine_faces(motion._values)
    assert 0 < fine.sum()


def test_a_motion_goes_on_with_the_same_fine_faces_from_a_file_too(tmp_path):
    scene = plate_at_magnet(6, 1e-3, young_modulus=1e7)
    go = {"time_step": 1e-4, "progress": False}
    whole = ms.simulate(scene, steps=4, **go)
    first = ms.simulate(scene, steps=2, **go)
    assert first.end.fine_faces.any()
    first.end.save(tmp_path / "end.npz")
    again = ms.simulate(scene, steps=2, start=ms.MotionState.load(tmp_path / "end.npz"), **go)
    np.testing.assert_array_equal(again.positions[-1], whole.positions[-1])
    other = plate_at_magnet(6, 1e-3, young_modulus=1e7)
    wrong = ms.MotionState(0.0, first.end.state, first.end.velocity, fine_faces=np.ones(3))
    with pytest.raises(ValueError, match="fine_faces"):
        ms.simulate(other, steps=2, start=wrong, **go)


def test_a_motion_that_comes_near_a_magnet_warns():
    """Throw a sheet from 60 mm, where its faces may sample once, to 2 mm above the magnet."""
    clamped = flap()
    mesh = clamped.mesh.transformed(translation=(0, 0, 56e-3))
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=2e7,
        mass_density=1e3,
        remanent_magnetization=(0, 0, MAGNETIZATION),
    )
    scene = ms.Scene(sheet, field=clamped.fields[0], allow_rigid_motions=True)
    down = np.broadcast_to((0, 0, -58e-3 / 3e-3), (mesh.n_vertices, 3))
    with pytest.warns(ms.FieldSamplingWarning, match="the motion, in recorded state"):
        ms.simulate(scene, steps=30, time_step=1e-4, velocities=down, progress=False)


def test_faces_that_reach_out_of_a_grid_are_warned_of():
    mesh = ms.meshes.rectangle(0.01, 0.01, cells=(2, 2))
    below = ms.Dipoles([[0.005, 0.005, -0.004]], [[0, 0, 1e-3]])
    grid = ms.SampledField.from_function(
        below.flux_density, (-0.01, -0.01, 0.0), (0.02, 0.02, 0.02), (16, 16, 11)
    )
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e9, remanent_magnetization=(0, 0, 1e5))
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=grid)
    with pytest.warns(ms.FieldSamplingWarning, match="reach to where a field has no value"):
        ms.equilibrium(scene)


def test_a_warm_start_restores_the_fine_faces_of_its_state():
    pytest.importorskip("torch")
    scene = flap()
    first = ms.WarmStart(scene)
    found = first(load_factor=PUSH)
    second = ms.WarmStart(scene)
    second.load_state_dict(first.state_dict())
    assert np.array_equal(fine_faces(second.equilibria._values), fine_faces(found._values))
