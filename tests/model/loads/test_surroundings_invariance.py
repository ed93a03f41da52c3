"""Transformations that must not change a motion with contact, friction and water: frames, numbering, mirrors, threads."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

MESH = ms.meshes.rectangle(0.02, 0.01, cells=(4, 2), irregular=0.2, seed=3)
MAGNETIZATION, FLUX_DENSITY = np.array([2e4, 3e3, 5e3]), np.array([1e-3, 2e-3, 4e-3])  # A/m, T
VELOCITY, FLOW = np.array([0.05, -0.03, -0.1]), np.array([0.02, 0.03, 0.01])  # m/s
GRAVITY = np.array([0.5, 0.3, -9.81])
TURN = rotation_matrix(np.array([0.7, -1.1, 0.4]))
MIRROR = np.diag([1.0, -1.0, 1.0])
SHIFT = np.array([0.3, -0.2, 0.1])  # m
TIME_STEP = 2.0**-10  # s, so that times add up without rounding
INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2()]


def axial(transformation, vector):
    """Return a rotation vector in the rotated or mirrored frame; as an axial vector, it changes its sign in a mirror."""
    return np.linalg.det(transformation) * (transformation @ vector)


def swaying(transformation):
    return lambda t: (
        transformation @ [0.01 * t, 0.02 * t, 3e-4 * np.sin(50 * t)],
        axial(transformation, [0.3 * t, 0.2 * t, 0.5 * t]),
    )


def obstacles(transformation, shift):
    """Return a moving oblique plane and a moving ball, which a mirror maps to obstacles of their kind."""
    return [
        ms.obstacles.Plane(
            transformation @ [0.1, 0.05, 1.0],
            center=shift + transformation @ [0, 0, -3e-4],
            motion=swaying(transformation),
        ),
        ms.obstacles.Sphere(
            5e-3, center=shift + transformation @ [0.01, 0.005, -5.1e-3], motion=swaying(transformation)
        ),
    ]


def scene_of(transformation=None, shift=None, mesh=MESH, lagged=False):
    """Return a scene of a sheet above the obstacles in water, all of it rotated or mirrored and shifted."""
    transformation, shift = (
        np.eye(3) if transformation is None else transformation,
        np.zeros(3) if shift is None else shift,
    )
    sheet = ms.Shell(
        mesh.transformed(transformation, shift), thickness=1e-3, young_modulus=1e6, mass_density=1e3
    )
    contact = ms.Contact(
        obstacles(transformation, shift),
        friction_coefficient=0.4,
        sticking_speed=1e-3,
        smoothing=1e-4,
        contact_stiffness=100.0,
        lagged_friction=lagged,
        face_samples=1,
    )
    return ms.Scene(
        sheet,
        contacts=[contact],
        water=ms.Water(100.0, velocity=transformation @ FLOW, added_mass=0.2),
        gravity=transformation @ GRAVITY,
        field=ms.UniformField(),
        allow_rigid_motions=True,
    )


def fall(scene, transformation, integrator, steps=30, **options) -> ms.Trajectory:
    """Simulate the falling sheet; M and B are both transformed as vectors, since only M . B enters the energy."""
    return ms.simulate(
        scene,
        steps=steps,
        time_step=TIME_STEP,
        remanent_magnetization=transformation @ MAGNETIZATION,
        applied_flux_density=transformation @ FLUX_DENSITY,
        integrator=integrator,
        progress=False,
        **options,
    )


def moved(transformation=None, shift=None, mesh=MESH, integrator=INTEGRATORS[0], lagged=False):
    """Return positions and velocities of the falling sheet, transformed back."""
    transformation, shift = (
        np.eye(3) if transformation is None else transformation,
        np.zeros(3) if shift is None else shift,
    )
    motion = fall(
        scene_of(transformation, shift, mesh, lagged),
        transformation,
        integrator,
        velocities=transformation @ VELOCITY,
    )
    assert motion.energies["contact"].max() > 0
    return (motion.positions - shift) @ transformation, motion.velocities @ transformation


@pytest.fixture(
    scope="module", params=[(i, lagged) for i in INTEGRATORS for lagged in (False, True)], ids=repr
)
def here(request):
    integrator, lagged = request.param
    options = {"integrator": integrator, "lagged": lagged}
    return options, moved(**options)


def agree(found, expected):
    for each, there, scale in zip(found, expected, (0.02, 0.1), strict=True):
        assert np.abs(each - there).max() < 1e-8 * scale


def test_a_rotated_frame(here):
    options, expected = here
    agree(moved(TURN, **options), expected)


def test_a_shifted_frame(here):
    options, expected = here
    agree(moved(shift=SHIFT, **options), expected)


def test_a_mirrored_scene(here):
    options, expected = here
    agree(moved(MIRROR, **options), expected)
    agree(moved(TURN @ MIRROR, **options), expected)


def test_numbering_does_not_change_the_motion(here, rng):
    options, expected = here
    vertices, faces = rng.permutation(MESH.n_vertices), rng.permutation(MESH.n_faces)
    shuffled = ms.TriangleMesh(MESH.rest_positions[vertices], np.argsort(vertices)[MESH.faces[faces]])
    agree(moved(mesh=shuffled, **options), [each[:, vertices] for each in expected])


def test_the_side_of_the_normals(here):
    options, expected = here
    agree(moved(mesh=MESH.flipped(), **options), expected)


@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
def test_continued_motion_has_the_same_bits(integrator, lagged):
    """Check that a motion in two halves has the same bits; obstacles continue from their time."""
    scene = scene_of(lagged=lagged)
    whole = fall(scene, np.eye(3), integrator, velocities=VELOCITY)
    half = fall(scene, np.eye(3), integrator, steps=15, velocities=VELOCITY)
    rest = fall(scene, np.eye(3), integrator, steps=15, start=half)
    np.testing.assert_array_equal(rest.positions, whole.positions[15:])
    np.testing.assert_array_equal(rest.velocities, whole.velocities[15:])
    assert half.energies["contact"][-1] > 0 or rest.energies["contact"].max() > 0


@pytest.fixture
def thread_counts():
    before = ms.num_threads()
    yield (1, 2, 3)
    ms.set_num_threads(before)


def test_any_number_of_threads_gives_the_same_bits(thread_counts):
    """Check a mesh with enough points on its faces for several tasks."""
    fine = ms.meshes.rectangle(0.02, 0.01, cells=(24, 12), irregular=0.2, seed=3)
    scene = scene_of(mesh=fine)
    seen = set()
    for count in thread_counts:
        ms.set_num_threads(count)
        motion = fall(scene, np.eye(3), INTEGRATORS[0], steps=5, velocities=VELOCITY)
        assert motion.energies["contact"][-1] > 0
        seen.add((motion.positions.tobytes(), motion.velocities.tobytes(), motion.iterations))
    assert len(seen) == 1
