"""Friction of a soft block on a slope (F4): it sticks or slides as Coulomb's law of its resultants predicts."""

import numpy as np
import pytest

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

GRAVITY = 9.81  # m/s2
SIDE, TIME_STEP = 0.02, 5e-3  # m, s
STICKING = 1e-4 * SIDE  # m/s: slower is at rest
DOWNHILL, ACROSS, NORMAL = np.eye(3)

# slope [deg], friction coefficient, acceleration [m/s2]
F4 = [
    (20, 0.3, 0.5897022231),
    (20, 0.36, 0.03659914646),
    (20, 0.37, 0.0),
    (30, 0.5, 0.6571453944),
    (30, 0.6, 0.0),
]
ROWS = pytest.mark.parametrize(("degrees", "friction", "acceleration"), F4)
ELEMENTS = pytest.mark.parametrize("element", ["linear", "quadratic"])


def slid(
    degrees, friction, *, element="linear", tilted=False, lagged=False, velocities=(0.0, 0.0, 0.0), steps=80
):
    """Return the velocity of the mass center down the slope, across and off it at the ends of steps, (n, 3) in m/s.

    tilted: the slope and the block are rotated; otherwise gravity is.
    """
    angle = np.radians(degrees)
    turn = rotation_matrix(np.array([0.0, angle, 0.0])) if tilted else np.eye(3)
    box = ms.meshes.box((SIDE, SIDE, SIDE), cells=(2, 2, 2))
    mesh = ms.TetMesh(box.rest_positions @ turn.T, box.tetrahedra)
    material = ms.NeoHookean(young_modulus=2e5, poisson_ratio=0.45)
    block = ms.Solid(mesh, material=material, mass_density=1e3, element=element)
    ground = ms.Contact(
        ms.obstacles.slope(-angle) if tilted else ms.obstacles.Plane(),
        friction_coefficient=friction,
        sticking_speed=STICKING,
        smoothing=2e-6,
        lagged_friction=lagged,
    )
    down = GRAVITY * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    gravity = (0.0, 0.0, -GRAVITY) if tilted else down
    scene = ms.Scene(block, contacts=[ground], gravity=gravity, allow_rigid_motions=True)
    motion = ms.simulate(
        scene,
        steps=steps,
        time_step=TIME_STEP,
        velocities=turn @ np.array(velocities),
        stiffness_damping=5e-3,
        integrator=ms.ImplicitEuler(),
        solver=ms.MixedNewton(tolerance=1e-11),
        progress=False,
    )
    return (
        ms.control.track(motion.velocities, np.arange(block.mesh.n_vertices), block.vertex_masses).numpy()
        @ turn
    )


def held(velocities, degrees) -> tuple[np.ndarray, np.ndarray]:
    """Compute friction against sliding and the normal force per mass in every step, in m/s2, from the motion."""
    change = np.diff(velocities, axis=0) / TIME_STEP
    angle = np.radians(degrees)
    return GRAVITY * np.sin(angle) - change @ DOWNHILL, GRAVITY * np.cos(angle) + change @ NORMAL


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@ELEMENTS
@ROWS
def test_accelerations_are_those_of_the_validation_set(degrees, friction, acceleration, element):
    """Check the second half of the motion, when the block has settled on the ground."""
    along = slid(degrees, friction, element=element) @ DOWNHILL
    if acceleration:
        half = len(along) // 2
        found = (along[-1] - along[half]) / (TIME_STEP * (len(along) - 1 - half))
        assert found == pytest.approx(acceleration, rel=5e-3)
    else:
        assert 0 < along[-1] < STICKING


@pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])
@ELEMENTS
def test_sliding_friction_is_its_coefficient_of_the_normal_force(element, lagged):
    velocities = slid(30, 0.5, element=element, lagged=lagged)
    friction, normal = (each[40:] for each in held(velocities, 30))
    np.testing.assert_allclose(friction, 0.5 * normal, rtol=1e-6)


def test_friction_is_against_the_motion_where_that_is_oblique():
    """Push the block across a slope of 20 degrees with mu = 0.3; its motion across vanishes in the end."""
    velocities = slid(20, 0.3, velocities=(0.0, 0.2, 0.0), steps=40)
    change = np.diff(velocities, axis=0)[10:] / TIME_STEP
    sliding = velocities[11:] * (DOWNHILL + ACROSS)
    friction = change * (DOWNHILL + ACROSS) - GRAVITY * np.sin(np.radians(20)) * DOWNHILL
    normal = GRAVITY * np.cos(np.radians(20)) + change @ NORMAL
    direction = sliding / np.linalg.norm(sliding, axis=1, keepdims=True)
    np.testing.assert_allclose(friction, -0.3 * normal[:, None] * direction, atol=0.01 * 0.3 * normal.mean())


@pytest.mark.parametrize(("friction", "acceleration"), [(0.3, 0.5897022231), (0.37, 0.0)])
def test_on_a_slope_that_is_tilted_itself(friction, acceleration):
    upright, tilted = slid(20, friction), slid(20, friction, tilted=True)
    np.testing.assert_allclose(tilted, upright, rtol=0, atol=1e-6 * np.abs(upright).max())
