"""Friction of a block on an incline (F1): it sticks, creeps, slides and stops as Coulomb's law predicts."""

import numpy as np
import pytest
from blocks import GRAVITY, STICKING, block_on, block_sheet, resting_on_plane, simulated

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

# F1 of the validation's reference.json; ipc-sim/IPC and rigid-ipc, "slopeTest_highSchoolPhysics".
TANGENT = 0.5  # of the slope
ANGLE = np.arctan(TANGENT)
TIME, TIME_STEP = 2.5, 0.025  # s
ACCELERATION_049 = 0.08765386471799184  # m/s2, with mu = 0.49 and g = 9.8
DISTANCE_049 = 0.2739183272437245  # m in 2.5 s

STEPS = round(TIME / TIME_STEP)
EULER_DISTANCE = ACCELERATION_049 * TIME_STEP**2 * STEPS * (STEPS + 1) / 2
TILTED = GRAVITY * np.array([np.sin(ANGLE), 0.0, -np.cos(ANGLE)])
DOWNHILL = np.array([np.cos(ANGLE), 0.0, -np.sin(ANGLE)])
SECOND_ORDER = [ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3()]


def on_tilted_gravity(friction, **contact):
    """Return a scene with plane z = 0 and oblique gravity, the block's rest positions, and the downhill direction."""
    scene = block_on(ms.obstacles.Plane(), friction, gravity=TILTED, **contact)
    return scene, resting_on_plane(scene.shell, GRAVITY * np.cos(ANGLE)), np.array([1.0, 0.0, 0.0])


def on_slope(friction, **contact):
    """Return a scene with vertical gravity and a slope along x, the block's rest positions, and the way downhill."""
    sheet = block_sheet()
    flat = resting_on_plane(sheet, GRAVITY * np.cos(ANGLE))
    turn = rotation_matrix(np.array([0.0, ANGLE, 0.0]))
    mesh = ms.TriangleMesh(sheet.mesh.rest_positions @ turn.T, sheet.mesh.faces)
    turned = ms.Shell(mesh, thickness=2e-3, young_modulus=1e9, mass_density=1e3)
    scene = block_on(ms.obstacles.slope(-ANGLE), friction, sheet=turned, **contact)
    return scene, flat @ turn.T, DOWNHILL


PLACES = pytest.mark.parametrize("make_scene", [on_tilted_gravity, on_slope])
FRICTIONS = pytest.mark.parametrize("lagged", [False, True], ids=["exact", "lagged"])


def slid(make_scene, friction, time=TIME, time_step=TIME_STEP, lagged=False, **options):
    """Return distances (n, n_v) in m and speeds (n, n_v) in m/s down the slope."""
    scene, start, downhill = make_scene(friction, lagged_friction=lagged)
    motion = simulated(scene, round(time / time_step), time_step, start=start, **options)
    return (motion.positions - start) @ downhill, motion.velocities @ downhill


def test_published_numbers_are_those_of_the_closed_form():
    assert GRAVITY * (np.sin(ANGLE) - 0.49 * np.cos(ANGLE)) == pytest.approx(ACCELERATION_049, rel=1e-12)
    assert 0.5 * ACCELERATION_049 * TIME**2 == pytest.approx(DISTANCE_049, rel=1e-12)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@PLACES
@FRICTIONS
def test_slides_at_049_as_far_as_backward_euler(make_scene, lagged):
    distances, _ = slid(make_scene, 0.49, lagged=lagged)
    np.testing.assert_allclose(distances[-1], EULER_DISTANCE, rtol=1e-5)  # the validation set requires 1e-3


@PLACES
@FRICTIONS
def test_sticks_at_050(make_scene, lagged):
    distances, speeds = slid(make_scene, 0.5, lagged=lagged)
    assert speeds.max() <= STICKING * (1 + 1e-6)
    assert distances[-1].max() <= STICKING * TIME


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("integrator", SECOND_ORDER, ids=repr)
def test_methods_of_second_order_reach_the_continuous_distance(integrator):
    distances, _ = slid(on_tilted_gravity, 0.49, integrator=integrator)
    np.testing.assert_allclose(distances[-1], DISTANCE_049, rtol=1e-4)


@pytest.mark.parametrize("integrator", SECOND_ORDER, ids=repr)
def test_methods_of_second_order_stick(integrator):
    """Check that the overshoot of the first step does not grow.

    At mu = 0.50 friction balances any speed above the sticking speed.
    """
    _, speeds = slid(on_tilted_gravity, 0.5, integrator=integrator)
    assert speeds.max() <= 3 * STICKING
    np.testing.assert_allclose(speeds[-1], speeds[2], rtol=1e-2)
    _, speeds = slid(on_tilted_gravity, 0.51, integrator=integrator)
    assert speeds[-1].max() <= STICKING * (1 - np.sqrt(1 - TANGENT / 0.51)) * (1 + 1e-3)


@pytest.mark.parametrize("friction", [0.505, 0.6, 1.0, 2.0])
@FRICTIONS
def test_sticking_block_creeps_by_the_formula(friction, lagged):
    """Compare with e (1 - sqrt(1 - r)), where the slope needs the fraction r = tan(alpha) / mu of the friction."""
    _, speeds = slid(on_tilted_gravity, friction, time=0.25, lagged=lagged)
    creep = STICKING * (1 - np.sqrt(1 - TANGENT / friction))
    np.testing.assert_allclose(speeds[-1], creep, rtol=1e-5)


def test_ten_seconds_at_rest():
    distances, _ = slid(on_tilted_gravity, 0.6, time=10.0)
    assert distances[-1].max() <= 10.0 * STICKING
    assert distances[-1].max() == pytest.approx(10.0 * STICKING * (1 - np.sqrt(1 - TANGENT / 0.6)), rel=1e-3)


def test_ten_seconds_at_rest_on_level_ground():
    scene = block_on(ms.obstacles.Plane(), 0.6)
    start = resting_on_plane(scene.shell)
    motion = simulated(scene, 400, TIME_STEP, start=start)
    np.testing.assert_allclose(motion.positions[-1], start, rtol=0, atol=1e-11)


SPEED, STOPPING_FRICTION = 0.5, 0.4  # m/s, 1


def stopping(time_step, integrator, lagged=False):
    scene = block_on(ms.obstacles.Plane(), STOPPING_FRICTION, lagged_friction=lagged)
    start = resting_on_plane(scene.shell)
    steps = round(0.15 / time_step)
    motion = simulated(scene, steps, time_step, start=start, velocities=(SPEED, 0, 0), integrator=integrator)
    return motion.times, (motion.positions - start)[:, :, 0].mean(axis=1), motion.velocities[:, :, 0]


@FRICTIONS
def test_stops_as_far_as_backward_euler(lagged):
    """Check that step k ends at v0 - k mu g dt until the remaining speed is lost."""
    time_step = 1e-3
    times, distances, speeds = stopping(time_step, ms.ImplicitEuler(), lagged)
    slowing = STOPPING_FRICTION * GRAVITY
    expected = SPEED - np.arange(1, len(times)) * slowing * time_step
    moving = expected > 0
    np.testing.assert_allclose(speeds[1:][moving], expected[moving, None] * np.ones(9), rtol=1e-4, atol=1e-6)
    assert distances[-1] == pytest.approx((expected[moving] * time_step).sum(), rel=1e-3)
    # Stop time: v0 / (mu g), within a step.
    stop = times[np.argmax(speeds.max(axis=1) < STICKING)]
    assert abs(stop - SPEED / slowing) <= time_step
    assert np.abs(speeds[times > stop + 5 * time_step]).max() < 1e-2 * STICKING


@pytest.mark.parametrize("integrator", SECOND_ORDER, ids=repr)
def test_stops_as_far_as_the_textbook_says(integrator):
    _, distances, speeds = stopping(1e-3, integrator)
    assert distances[-1] == pytest.approx(SPEED**2 / (2 * STOPPING_FRICTION * GRAVITY), rel=1e-3)
    assert np.abs(speeds[-1]).max() < STICKING


CREEP = 1e-3  # m/s, the sticking speed on ground that moves


def simulated_on_moving_plane(motion, friction, steps, integrator, velocities=None, at=(0.0, 0.0), **contact):
    """Simulate a block on a moving plane for `steps` milliseconds."""
    scene = block_on(ms.obstacles.Plane(motion=motion), friction, sticking_speed=CREEP, **contact)
    start = resting_on_plane(scene.shell) + np.array([*at, 0.0])
    if velocities is not None:
        velocities = velocities(start)
    return simulated(scene, steps, 1e-3, start=start, velocities=velocities, integrator=integrator)


@FRICTIONS
def test_a_conveyor_takes_a_block_along(lagged):
    """Check that the block gains mu g dt per step until it has the speed of the belt."""
    belt, friction, steps = 0.1, 0.3, 60
    motion = simulated_on_moving_plane(
        lambda t: (belt * t, 0, 0), friction, steps, ms.ImplicitEuler(), lagged_friction=lagged
    )
    expected = np.minimum(friction * GRAVITY * motion.times, belt)
    speeds = motion.velocities[:, :, 0]
    np.testing.assert_allclose(speeds, expected[:, None] * np.ones(9), rtol=0, atol=CREEP)
    np.testing.assert_allclose(speeds[-1], belt, rtol=1e-6)


@pytest.mark.parametrize("share", [0.9, 1.2])
def test_a_belt_that_accelerates(share):
    """Check the block on a belt that accelerates by a fraction of mu g.

    Up to mu g the block lags behind the belt by its creep; beyond, it keeps the acceleration mu g.
    """
    limit, steps = 0.3 * GRAVITY, 40
    motion = simulated_on_moving_plane(
        lambda t: (0.5 * share * limit * t**2, 0, 0), 0.3, steps, ms.ImplicitEuler()
    )
    time = motion.times[-1]
    behind = share * limit * time - motion.velocities[-1, :, 0]
    if share < 1:
        np.testing.assert_allclose(behind, CREEP * (1 - np.sqrt(1 - share)), rtol=1e-3)
    else:
        np.testing.assert_allclose(behind, (share - 1) * limit * time, rtol=0, atol=CREEP)


def on_a_disc(spin, friction, steps):
    """Return the times and the distances (n,) in m of a block's middle from the axis; it starts at the disc's speed."""
    motion = simulated_on_moving_plane(
        lambda t: ((0, 0, 0), (0, 0, spin * t)),
        friction,
        steps,
        ms.TRBDF2(),
        velocities=lambda start: np.cross([0, 0, spin], start),
        at=(0.09, -0.01),
    )
    return motion.times, np.linalg.norm(motion.positions[:, :, :2].mean(axis=1), axis=1)


def test_block_on_a_disc_creeps_outwards():
    """Check the outward creep given by the fraction w^2 r / (mu g) of the friction."""
    times, distances = on_a_disc(4.0, 0.6, 200)
    creep = CREEP * (1 - np.sqrt(1 - 4.0**2 * 0.1 / (0.6 * GRAVITY)))
    assert (distances[-1] - distances[50]) / (times[-1] - times[50]) == pytest.approx(creep, rel=2e-2)


def test_block_slides_off_a_fast_disc():
    _, distances = on_a_disc(12.0, 0.6, 200)
    assert distances[0] == pytest.approx(0.1)
    assert distances[-1] > 0.15
