"""Six-node shells and solids near magnets: forces that are off are warned of."""

import warnings

import numpy as np
import pytest
from magnet_forces import VACUUM_PERMEABILITY, cuboid_force

import magshell as ms
from magshell.model.scene.element_sampling import element_forces
from magshell.model.scene.field_sampling import _sources

WIDTH, HEIGHT, MAGNETIZATION = 10e-3, 2e-3, 1e5


def block_at_magnet(gap, cells=(8, 8, 2), young_modulus=1e12, **options):
    """Return a scene of a block above a magnet of its size, gap [m] apart, both magnetized along z, and the exact force."""
    mesh = ms.meshes.box((WIDTH, WIDTH, HEIGHT), cells=cells)
    mesh = mesh.transformed(translation=np.array([0.0, 0.0, gap]) - mesh.rest_positions.min(axis=0))
    material = ms.NeoHookean(young_modulus=young_modulus, poisson_ratio=0.3)
    block = ms.Solid(
        mesh, material=material, mass_density=1e3, remanent_magnetization=(0, 0, MAGNETIZATION), **options
    )
    magnet = ms.CuboidMagnet(
        (WIDTH, WIDTH, HEIGHT),
        remanent_magnetization=(0, 0, MAGNETIZATION),
        center=(WIDTH / 2, WIDTH / 2, -HEIGHT / 2),
    )
    size = (WIDTH, WIDTH, HEIGHT)
    exact = cuboid_force(size, size, (0, 0, gap + HEIGHT), 2, VACUUM_PERMEABILITY * MAGNETIZATION)
    scene = ms.Scene(block, supports=[ms.Pin(block.mesh.vertices_at(x=0.0))], field=magnet)
    return scene, exact


def plate_at_magnet(gap, cells):
    thickness = 2e-4
    mesh = ms.meshes.rectangle(WIDTH, WIDTH, cells=(cells, cells), order=2)
    mesh = mesh.transformed(translation=(0, 0, gap + thickness))
    plate = ms.Shell(
        mesh, thickness=thickness, young_modulus=1e13, remanent_magnetization=(0, 0, MAGNETIZATION)
    )
    size = (WIDTH, WIDTH, thickness)
    magnet = ms.CuboidMagnet(
        size, remanent_magnetization=(0, 0, MAGNETIZATION), center=(WIDTH / 2, WIDTH / 2, 0)
    )
    exact = cuboid_force(size, size, (0, 0, gap + thickness), 2, VACUUM_PERMEABILITY * MAGNETIZATION)
    return ms.Scene(plate, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=magnet), exact


def compared(scene):
    """Return the forces on the elements at rest as a solve takes them, and as they are."""
    values, positions = scene._values, scene.mesh.rest_positions
    with values.in_core():
        (found,) = element_forces(values, positions, _sources(values, positions, 1.0, None))
    return found.taken.sum(axis=0), found.mean.sum(axis=0)


def warned(call) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(each.message) for each in caught if each.category is ms.FieldSamplingWarning]


@pytest.mark.parametrize("law", ["stretches", "rotates"])
@pytest.mark.parametrize(("element", "gap"), [("linear", 1e-3), ("linear", 5e-4), ("quadratic", 5e-4)])
def test_forces_on_solids_are_compared_with_the_exact_ones(element, gap, law):
    scene, exact = block_at_magnet(gap, (6, 6, 2), element=element, magnetization_law=law)
    taken, mean = compared(scene)
    size = np.linalg.norm(exact)
    np.testing.assert_allclose(
        taken, ms.forces(scene, scene.mesh.rest_positions).on_vertices.sum(axis=0), atol=1e-10 * size
    )
    np.testing.assert_allclose(mean, exact, rtol=0, atol=1e-3 * size)


@pytest.mark.parametrize(("cells", "gap"), [(8, 5e-4), (12, 2e-4)])
def test_forces_on_six_node_shells_are_compared_with_the_exact_ones(cells, gap):
    scene, exact = plate_at_magnet(gap, cells)
    taken, mean = compared(scene)
    size = np.linalg.norm(exact)
    np.testing.assert_allclose(
        taken, ms.forces(scene, scene.mesh.rest_positions).on_vertices.sum(axis=0), atol=1e-10 * size
    )
    np.testing.assert_allclose(mean, exact, rtol=0, atol=2e-3 * size)


def test_elements_follow_a_deformed_body():
    """Check bodies that are turned and stretched: what is compared is the force of the core."""
    rng = np.random.default_rng(0)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    scenes = [block_at_magnet(2e-3, (2, 2, 1), element=each)[0] for each in ("linear", "quadratic")]
    scenes += [block_at_magnet(2e-3, (2, 2, 1), magnetization_law="rotates")[0], plate_at_magnet(2e-3, 3)[0]]
    for scene in scenes:
        rest = scene.mesh.rest_positions
        middle = rest.mean(axis=0)
        positions = middle + (0, 0, 6e-3) + 0.5 * (rest - middle) @ np.diag([1.2, 0.9, 1.1]) @ turn.T
        positions += 1e-4 * rng.normal(size=rest.shape)
        values = scene._values
        with values.in_core():
            (found,) = element_forces(values, positions, _sources(values, positions, 1.0, None))
            model = scene._model
            state = model.state(positions, np.zeros(scene._bodies.n_rotations))
            ones = scene._load_parameter_layout.packed(
                {("scene", "field_factor"): 1.0}, scene._load_parameter_layout.zeros()
            )
            force = -model.positions(model.term_gradient("magnetic", state, ones)).sum(axis=0)
        np.testing.assert_allclose(
            found.taken.sum(axis=0), force, rtol=0, atol=1e-9 * np.abs(found.taken).sum()
        )


def test_solids_near_a_magnet_are_warned_of_and_others_are_not():
    near, far = block_at_magnet(1e-3, element="linear")[0], block_at_magnet(3e-3, element="linear")[0]
    (told,) = warned(lambda: ms.equilibrium(near, progress=False))
    assert "this equilibrium: the magnetic force on Solid(" in told and "Take smaller elements" in told
    assert not warned(lambda: ms.equilibrium(far, progress=False))
    assert not warned(lambda: ms.equilibrium(block_at_magnet(1e-3, (4, 4, 1))[0], progress=False))


def test_paths_and_motions_of_solids_near_a_magnet_are_warned_of():
    scene, _ = block_at_magnet(1e-3, (8, 8, 2), element="linear")
    (told,) = warned(lambda: ms.follow_path(scene, progress=False))
    assert "the path, at point" in told and "1.28%" in told
    (told,) = warned(lambda: ms.simulate(scene, steps=1, time_step=1e-6, progress=False))
    assert "the motion, in recorded state" in told


def test_a_six_node_shell_near_a_magnet_is_warned_of():
    (told,) = warned(lambda: ms.equilibrium(plate_at_magnet(2e-4, 16)[0], progress=False))
    assert "the magnetic force on Shell(" in told and "as its elements sample the field at few points" in told
