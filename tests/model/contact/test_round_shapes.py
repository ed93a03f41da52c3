"""Smooth balls and capsules of rigid bodies that touch obstacles and each other: closed forms, momentum, refusals."""

import pickle

import numpy as np
import pytest

import magshell as ms
from magshell import obstacles as ob
from magshell.output.results.state import states_of

G = 9.81
R = 5e-3  # m, radius of all balls
pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")  # impacts in few steps
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}
INTEGRATORS = [ms.ImplicitEuler(), ms.TRBDF2(), ms.TRBDF2(implicit_contact=True), ms.SDIRK3()]


def ball_at(center, mass=4e-3, **motion):
    """Build a rigid body of a full ball's inertia, and its smooth surface."""
    body = ms.RigidBody(mass=mass, inertia=0.4 * mass * R**2, center=center, **motion)
    return body, ob.Attached(ob.Sphere(R, center=center), to=body)


def momenta_of(move, bodies):
    """Return the momentum and the angular momentum about the origin at all times, (n, 3) each."""
    momentum = sum(body.mass * move[body].velocity for body in bodies)
    spins = sum(0.4 * body.mass * R**2 * move[body].angular_velocity for body in bodies)
    orbits = sum(body.mass * np.cross(move[body].center, move[body].velocity) for body in bodies)
    return momentum, spins + orbits


def collide(integrator, aside=0.0, **contact):
    a, round_a = ball_at((0, 0, 0), velocity=(0.3, 0.1, 0), angular_velocity=(20, -10, 5))
    b, round_b = ball_at((2 * R + 5e-4, aside, 0.3 * aside), mass=6e-3, velocity=(-0.4, 0.1, 0))
    touch = ms.Contact(round_b, shapes=round_a, contact_stiffness=2e3, **contact)
    scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
    return (a, b), touch, ms.simulate(scene, steps=80, time_step=1e-4, integrator=integrator, **EXACT)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=str)
def test_central_collision_is_that_of_the_reduced_mass_with_a_wall(integrator):
    (a, b), touch, move = collide(integrator)
    momentum, _ = momenta_of(move, (a, b))
    assert np.abs(momentum - momentum[0]).max() < 1e-11 * a.mass
    assert any(len(move.contact_state(touch, k).shape_pairs) for k in range(80))
    mass = a.mass * b.mass / (a.mass + b.mass)
    one, round_one = ball_at((0, 0, 0), mass=mass, velocity=(0.7, 0, 0))
    wall = ob.Plane(center=(R + 5e-4, 0, 0), rotation=(0, -np.pi / 2, 0))
    alone = ms.Scene(
        one,
        contacts=[ms.Contact(wall, shapes=round_one, contact_stiffness=2e3)],
        allow_rigid_motions=True,
    )
    against = ms.simulate(alone, steps=80, time_step=1e-4, integrator=integrator, **EXACT)
    apart = move[b].velocity[-1, 0] - move[a].velocity[-1, 0]
    assert apart == pytest.approx(-against[one].velocity[-1, 0], rel=1e-7)
    assert apart > 0.3
    assert move[a].angular_velocity[-1] == pytest.approx([20, -10, 5], rel=1e-9)


@pytest.mark.parametrize(
    ("integrator", "bound"), list(zip(INTEGRATORS, (2e-2, 2e-4, 2e-2, 2e-4), strict=True)), ids=str
)
def test_rubbing_collision_keeps_both_momenta(integrator, bound):
    """Bound the angular momentum's error: 2.5e-3 by Euler, 1.3e-3 by implicit contact, 1.5e-5 by the others (theory)."""
    (a, b), _, move = collide(integrator, aside=4e-3, friction_coefficient=0.4)
    momentum, turning = momenta_of(move, (a, b))
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * a.mass
    assert np.abs(move[a].angular_velocity[-1] - [20, -10, 5]).max() > 5.0
    size = a.mass * 0.5 * 2 * R
    assert np.abs(turning - turning[0]).max() < bound * size


def test_implicit_euler_gains_no_energy_where_balls_meet_obliquely_within_a_step():
    """Check the energy watch: contact of two balls is not convex, and implicit Euler gained 14 % without it."""
    divided = 0
    for stiffness in (2e3, 5e4):
        a, round_a = ball_at((0, 0, 0), velocity=(1, 0, 0))
        b, round_b = ball_at((2 * R + 5e-4, R, 0), mass=6e-3, velocity=(-1, 0, 0))
        touch = ms.Contact(round_b, shapes=round_a, contact_stiffness=stiffness)
        scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
        move = ms.simulate(scene, steps=12, time_step=5e-3, integrator=ms.ImplicitEuler(), **EXACT)
        assert move.energy.max() <= 1.005 * move.energy[0]  # 0.1 % a step with contact is tolerated
        divided += len(move.substeps)
    assert divided > 0


@pytest.mark.parametrize("integrator", [ms.ImplicitEuler(), ms.TRBDF2(implicit_contact=True)], ids=repr)
def test_energy_that_even_the_shortest_part_of_a_step_gains_is_told(integrator):
    """Let two balls meet obliquely in a step so long that 1/64 of it does not resolve the impact either."""
    a, round_a = ball_at((0, 0, 0), velocity=(1, 0, 0))
    b, round_b = ball_at((2 * R + 5e-4, R, 0), mass=6e-3, velocity=(-1, 0, 0))
    touch = ms.Contact(round_b, shapes=round_a, contact_stiffness=2e3)
    scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
    with pytest.warns(ms.StepErrorWarning, match="created energy in contact even in their shortest parts"):
        move = ms.simulate(scene, steps=1, time_step=0.32, integrator=integrator, **EXACT)
    assert move.energy[-1] > 1.05 * move.energy[0]  # by 12.5 %
    assert move.energy_gain_steps == (0,) and "1 gained energy in contact" in repr(move)
    short = ms.simulate(scene, steps=40, time_step=1e-4, integrator=integrator, **EXACT)
    assert short.energy.max() <= 1.005 * short.energy[0] and not short.energy_gain_steps


def test_three_balls_in_a_row_pass_on_the_velocity():
    """Let one ball hit the first of two that rest 0.2 mm apart: the last flies on alone."""
    gap, speed = 2e-4, 0.5
    balls = [ball_at((k * (2 * R + gap), 0, 0), velocity=(speed if k == 0 else 0.0, 0, 0)) for k in range(3)]
    shapes = [shape for _, shape in balls]
    touch = ms.Contact(shapes, shapes=shapes, contact_stiffness=5e4)
    scene = ms.Scene([body for body, _ in balls], contacts=[touch], allow_rigid_motions=True)
    move = ms.simulate(scene, steps=400, time_step=1e-5, integrator=ms.TRBDF2(), **EXACT)
    ends = [move[body].velocity[-1, 0] for body, _ in balls]
    assert ends == pytest.approx([0.0, 0.0, speed], abs=0.02 * speed)
    assert sum(ends) == pytest.approx(speed, rel=1e-10)
    assert len(touch._rounds) == 3


def in_a_groove(angle, **options):
    """Build a ball between two capsules along y, whose normals are tilted by +-angle."""
    body, ball = ball_at((0, 0, 0))
    reach = 2 * R - 1e-5
    rods = [
        ob.Capsule(
            0.05,
            R,
            center=(sign * reach * np.sin(angle), 0, -reach * np.cos(angle)),
            rotation=(0, 0, np.pi / 2),
        )
        for sign in (-1, 1)
    ]
    touch = ms.Contact(rods, shapes=ball, contact_stiffness=2e4, **options)
    return body, touch, ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)


@pytest.mark.parametrize("angle", [0.5, 1.0])
def test_ball_in_a_groove_of_two_capsules_presses_by_statics(angle):
    body, touch, scene = in_a_groove(angle, friction_coefficient=0.0)
    move = ms.simulate(scene, steps=400, time_step=1e-3, damping=50.0, integrator=ms.ImplicitEuler(), **EXACT)
    state = move.contact_state(touch)
    assert state.normal_forces == pytest.approx(np.full(2, body.mass * G / (2 * np.cos(angle))), rel=5e-3)
    assert state.shape_pairs.tolist() == [[0, 0], [0, 1]]
    assert np.abs(state.normals[:, 1]).max() < 1e-9
    assert state.normal_forces * state.normals[:, 2] == pytest.approx(
        np.full(2, 0.5 * body.mass * G), rel=1e-9
    )


def test_ball_rolls_off_a_ball_as_the_energy_says():
    """Compare a ball that rolls without slip from 0.3 rad: 7/10 v2 = g (R + r) (cos 0.3 - cos a)."""
    big = 0.02
    reach = big + R
    start = 0.3
    center = reach * np.array([np.sin(start), 0, np.cos(start)])
    depth = 4e-3 * G * np.cos(start) / 2e4
    body, ball = ball_at(center * (1 - depth / reach))
    touch = ms.Contact(
        ob.Sphere(big), shapes=ball, contact_stiffness=2e4, friction_coefficient=1.0, sticking_speed=1e-5
    )
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=160, time_step=5e-4, integrator=ms.TRBDF2(), **EXACT)
    centers, speeds = move[body].center, np.linalg.norm(move[body].velocity, axis=1)
    angles = np.arctan2(centers[:, 0], centers[:, 2])
    k = int(np.searchsorted(angles, 0.6))
    assert 10 < k < 160
    expected = np.sqrt(10 / 7 * G * reach * (np.cos(start) - np.cos(angles[k])))
    assert speeds[k] == pytest.approx(expected, rel=2e-3)
    assert move[body].angular_velocity[k] == pytest.approx([0, speeds[k] / R, 0], rel=5e-3, abs=1e-6)


def test_ball_that_slides_on_a_plane_begins_to_roll_at_five_sevenths():
    body, ball = ball_at((0, 0, R - 4e-3 * G / 2e3), velocity=(0.2, 0, 0))
    touch = ms.Contact(
        ob.Plane(), shapes=ball, contact_stiffness=2e3, friction_coefficient=0.3, sticking_speed=1e-5
    )
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=80, time_step=5e-4, **EXACT)
    ends = 2 / 7 * 0.2 / (0.3 * G)
    assert move.times[-1] > 1.5 * ends
    assert move[body].velocity[-1] == pytest.approx([0.2 * 5 / 7, 0, 0], rel=2e-3, abs=1e-4)
    half = int(np.searchsorted(move.times, 0.5 * ends))
    assert move[body].velocity[half, 0] == pytest.approx(0.2 - 0.3 * G * move.times[half], rel=2e-2)


def rod_at(center, rotation, length=0.02, mass=4e-3, **motion):
    inertia = np.array([0.4 * mass * R**2, *[mass * (0.25 * R**2 + length**2 / 10)] * 2])
    turned = ob._motion.matrix(np.array(rotation, dtype=float))
    body = ms.RigidBody(mass=mass, inertia=turned @ np.diag(inertia) @ turned.T, center=center, **motion)
    return body, ob.Attached(ob.Capsule(length, R, center=center, rotation=rotation), to=body)


def test_capsule_on_a_plane_stands_on_both_ends():
    body, rod = rod_at((0, 0, R), (0, 0, 0.4))
    touch = ms.Contact(ob.Plane(), shapes=rod, contact_stiffness=1e3)
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=300, time_step=1e-3, damping=50.0, integrator=ms.ImplicitEuler(), **EXACT)
    assert move.contact_state(touch).normal_forces == pytest.approx(np.full(2, 0.5 * body.mass * G), rel=1e-4)


@pytest.mark.parametrize("friction", [None, 0.5])
def test_crossing_capsules_touch_where_their_axes_are_nearest(friction):
    """Let one fall across another at rest; momenta are kept and the force is along the common normal."""
    a, rod_a = rod_at((0, 0, 0), (0, 0, 0.0))
    b, rod_b = rod_at((1e-3, 2e-3, 2 * R + 2e-4), (0, 0, 1.2), velocity=(0, 0.05, -0.3))
    touch = ms.Contact(rod_a, shapes=rod_b, contact_stiffness=2e3, friction_coefficient=friction)
    scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
    move = ms.simulate(scene, steps=60, time_step=1e-4, integrator=ms.TRBDF2(), **EXACT)
    touching = [k for k in range(61) if len(move.contact_state(touch, k).shape_pairs)]
    assert touching
    assert move.contact_state(touch, touching[0]).normals[0] == pytest.approx([0, 0, 1], abs=1e-3)
    total = a.mass * move[a].velocity + b.mass * move[b].velocity
    assert np.abs(total - total[0]).max() < 1e-10 * a.mass
    assert move[b].velocity[-1, 2] > -0.2
    if friction is None:
        assert move.energy[-1] == pytest.approx(move.energy[0], rel=1e-3)


@pytest.mark.parametrize("speed", [30.0, 300.0])
@pytest.mark.parametrize("integrator", INTEGRATORS, ids=str)
def test_fast_ball_does_not_jump_through_a_ball(integrator, speed):
    """Step by 3 and 30 diameters: the ball ends on the side from which it came, or the motion says what is wrong."""
    a, round_a = ball_at((0, 0, 0))
    b, round_b = ball_at((0.02, 0, 0), velocity=(-speed, 0, 0))
    touch = ms.Contact(round_a, shapes=round_b, contact_stiffness=1e6)
    scene = ms.Scene([a, b], contacts=[touch], allow_rigid_motions=True)
    try:
        move = ms.simulate(scene, steps=5, time_step=1e-3, integrator=integrator, progress=False)
    except ms.NotConverged as error:
        assert speed == 300.0
        assert "the shape of a rigid body passes through an obstacle" in str(error)
        return
    assert np.all(move[b].center[:, 0] > move[a].center[:, 0])


def test_pictures_and_copies_have_the_shapes():
    (a, b), touch, move = collide(ms.ImplicitEuler())
    for state, k in zip(states_of(move), range(81), strict=True):
        middle = 0.5 * (state.positions.min(axis=0) + state.positions.max(axis=0))
        assert middle == pytest.approx(move[a].center[k], abs=0.02 * R)  # the surface has facets
        assert state.obstacles[0].center == pytest.approx(move[b].center[k], abs=1e-12)
        assert len(state.obstacles) == 1
    other = pickle.loads(pickle.dumps(move.scene))
    again = ms.simulate(other, steps=80, time_step=1e-4, integrator=ms.ImplicitEuler(), **EXACT)
    here, there = move[a].center, again[other.rigid_parts[0]].center
    assert np.array_equal(here, there)
    assert "shapes Attached(Sphere" in repr(touch)


def test_misuse_of_shapes_is_refused():
    body, ball = ball_at((0, 0, 0.1))
    _, rod = rod_at((0, 0, 0.1), (0, 0, 0))
    cases = [
        ({"shapes": ob.Sphere(R)}, "shapes must be solid spheres, capsules, ellipsoids and boxes"),
        ({"shapes": ob.Attached(ob.Plane(), to=body)}, "shapes must be solid spheres"),
        ({"shapes": ob.Attached(ob.Sphere(R, inside=True), to=body)}, "shapes must be solid spheres"),
        ({"shapes": ball, "vertices": [0]}, "give vertices to another Contact"),
        ({"shapes": ball, "face_samples": 1}, "give face_samples to another Contact"),
    ]
    for options, words in cases:
        with pytest.raises(ValueError, match=words):
            ms.Contact(ob.Plane(), **options)
    with pytest.raises(ValueError, match="must hold two that different bodies carry"):
        ms.Contact(ball, shapes=ball)
    with pytest.raises(ValueError, match="a hollow Box can touch at several"):
        ms.Contact(ob.Box((1, 1, 1), inside=True), shapes=ball)
    with pytest.raises(ValueError, match="a capsule that a body carries can touch Plane, Sphere"):
        ms.Contact(ob.Tube([[0, 0, 0], [1, 0, 0]], radius=0.1), shapes=rod)
    deep, sunk = ball_at((0, 0, 0))
    scene = ms.Scene(deep, contacts=[ms.Contact(ob.Plane(), shapes=sunk)], allow_rigid_motions=True)
    with pytest.raises(ValueError, match="starts inside"):
        ms.simulate(scene, steps=1, time_step=1e-3)
    with pytest.raises(ValueError, match="rigid body that carries it is not in the scene"):
        ms.Scene(deep, contacts=[ms.Contact(ob.Plane(), shapes=ball)], allow_rigid_motions=True)
