"""Smooth ellipsoids and boxes of rigid bodies that touch obstacles and each other: closed forms and refusals."""

import numpy as np
import pytest
import scipy
from scipy.spatial.transform import Rotation

import magshell as ms
from magshell import obstacles as ob
from magshell.model.contact.round_shapes import gap, round_pairs

G = 9.81
AXES = np.array([9e-3, 6e-3, 4e-3])  # m
MASS = 4e-3  # kg
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12), "progress": False}
pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")  # impacts in few steps


def egg_at(center, rotation=(0.0, 0.0, 0.0), axes=AXES, mass=MASS, **motion):
    """Build a rigid body of a full ellipsoid's inertia, and its smooth surface."""
    own = mass / 5 * (np.sum(axes**2) - axes**2)
    turned = Rotation.from_rotvec(rotation).as_matrix()
    body = ms.RigidBody(mass=mass, inertia=turned @ np.diag(own) @ turned.T, center=center, **motion)
    return body, ob.Attached(ob.Ellipsoid(axes, center=center, rotation=rotation), to=body)


def gap_of(shape, obstacle):
    (pair,) = round_pairs([shape], [obstacle])
    return gap(pair, shape, obstacle, 0.0)


@pytest.mark.parametrize("apart", [2e-3, -3e-4])
def test_gap_to_a_plane_is_that_of_the_support_function(apart):
    rotation = Rotation.from_rotvec((0.5, -1.1, 0.8)).as_matrix()
    depth = np.linalg.norm(AXES * rotation[2])
    _, egg = egg_at((1e-3, 2e-3, depth + apart), (0.5, -1.1, 0.8))
    found = gap_of(egg, ob.Plane())
    assert found.distance == pytest.approx(apart, abs=1e-15)
    assert found.point[:2] == pytest.approx(
        [1e-3, 2e-3] - rotation[:2] @ (AXES**2 * rotation[2]) / depth, abs=1e-15
    )


@pytest.mark.parametrize("apart", [3e-3, 1e-6, -2e-4])
def test_gap_between_mirror_images_is_twice_that_to_the_mirror(apart):
    """Turn an ellipsoid and its mirror image at z = 0 in 20 ways: they touch there, at mirror images of one point."""
    flip = np.diag([1.0, 1.0, -1.0])
    for rotation in Rotation.random(20, random_state=3):
        turned = rotation.as_matrix()
        height = np.linalg.norm(AXES * turned[2]) + 0.5 * apart
        _, egg = egg_at((0, 0, height), rotation.as_rotvec())
        image = Rotation.from_matrix(flip @ turned @ flip).as_rotvec()
        _, other = egg_at((0, 0, -height), image)
        found = gap_of(egg, other)
        assert found.distance == pytest.approx(apart, abs=1e-14)
        assert found.normal == pytest.approx([0, 0, 1], abs=1e-7)


@pytest.mark.parametrize(
    "obstacle",
    [
        ob.Sphere(7e-3),
        ob.Capsule(0.02, 5e-3, rotation=(0.1, 0.2, 0.3)),
        ob.Ellipsoid((2e-3, 8e-3, 5e-3), rotation=(0.3, 0.1, 0.5)),
        ob.Box((0.02, 0.01, 0.015), rounding=2e-3, rotation=(0.5, 0.6, 0.2)),
    ],
    ids=lambda each: type(each).__name__,
)
def test_gap_is_the_least_distance_of_surface_points(obstacle):
    for rotation in Rotation.random(5, random_state=7):
        center = 0.018 * rotation.apply([0.3, 0.5, 0.8])
        _, egg = egg_at(center, rotation.as_rotvec())

        def distance(angles, turned=rotation, center=center):
            a, b = angles
            on_ball = np.stack([np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)], axis=-1)
            return obstacle.signed_distance(center + turned.apply(AXES * on_ball))

        grid = np.stack(np.meshgrid(np.linspace(0, 6.2, 25), np.linspace(0.1, 3.0, 20)), axis=-1).reshape(
            -1, 2
        )
        nearest = grid[np.argmin([distance(each) for each in grid])]
        least = scipy.optimize.minimize(
            distance, nearest, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-16}
        )
        assert gap_of(egg, obstacle).distance == pytest.approx(float(least.fun), abs=1e-10)


def rocking(friction, axes=AXES, tilt=2e-3):
    """Return the times at which an ellipsoid that rocks about y on a plane stands upright, s."""
    stiffness = 2e4
    sunk = MASS * G / stiffness
    height = np.sqrt((axes[0] * np.sin(tilt)) ** 2 + (axes[2] * np.cos(tilt)) ** 2) - sunk
    body, egg = egg_at((0, 0, height), (0, tilt, 0), axes)
    touch = ms.Contact(
        ob.Plane(),
        shapes=egg,
        contact_stiffness=stiffness,
        smoothing=1e-3 * sunk,
        friction_coefficient=friction,
        sticking_speed=1e-5,
    )
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=400, time_step=4e-4, integrator=ms.TRBDF2(), **EXACT)
    angle = tilt + np.arcsin(move[body].rotation[:, 0, 2])
    back = np.flatnonzero(np.sign(angle[1:]) != np.sign(angle[:-1]))
    share = angle[back] / (angle[back] - angle[back + 1])
    return move, move.times[back] + share * (move.times[1] - move.times[0])


def test_ellipsoid_without_friction_rocks_at_the_metacentric_frequency():
    """Compare with  w^2 = m g (R - c) / I,  R = a^2/c: the center moves up and down only."""
    move, upright = rocking(0.0)
    a, _, c = AXES
    inertia = MASS * (a**2 + c**2) / 5
    half = np.pi / np.sqrt(MASS * G * (a**2 / c - c) / inertia)
    assert np.diff(upright) == pytest.approx(half, rel=2e-3)
    assert len(upright) > 3
    assert np.ptp(move.energy) < 1e-4 * MASS * G * (a**2 / c - c) * 2e-6


def test_ellipsoid_that_sticks_rocks_about_its_point_of_contact():
    """Compare with  w^2 = m g (R - c) / (I + m c^2): the center moves to and fro as well."""
    _, upright = rocking(1.0)
    a, _, c = AXES
    inertia = MASS * (a**2 + c**2) / 5 + MASS * c**2
    half = np.pi / np.sqrt(MASS * G * (a**2 / c - c) / inertia)
    assert np.diff(upright) == pytest.approx(half, rel=5e-3)
    assert len(upright) > 2


@pytest.mark.parametrize("friction", [None, 0.4])
def test_round_ellipsoid_moves_as_a_ball(friction):
    radius = 5e-3
    ends = []
    for shape in (ob.Sphere, lambda r, **place: ob.Ellipsoid((r, r, r), **place)):
        center = (0, 0, radius + 1e-4)
        body = ms.RigidBody(
            mass=MASS,
            inertia=0.4 * MASS * radius**2,
            center=center,
            velocity=(0.2, 0.1, -0.3),
            angular_velocity=(3.0, -20.0, 5.0),
        )
        touch = ms.Contact(
            [ob.Plane(), ob.Sphere(0.01, center=(0.02, 0.003, 0))],
            shapes=ob.Attached(shape(radius, center=center), to=body),
            contact_stiffness=2e3,
            friction_coefficient=friction,
            sticking_speed=1e-3,
        )
        scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
        move = ms.simulate(scene, steps=100, time_step=2e-4, integrator=ms.TRBDF2(), **EXACT)
        ends.append(np.concatenate([move[body].center[-1] / radius, move[body].velocity[-1] / 0.3]))
    assert ends[1] == pytest.approx(ends[0], abs=1e-7)


def test_tumbling_ellipsoid_bounces_without_loss():
    body, egg = egg_at((0, 0, 0.013), (0.3, 0.5, 0.2), angular_velocity=(15.0, 4.0, 6.0))
    touch = ms.Contact(ob.Plane(), shapes=egg, contact_stiffness=2e3)
    scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=2000, time_step=1e-4, integrator=ms.TRBDF2(), **EXACT)
    touches = [bool(len(move.contact_state(touch, k).shape_pairs)) for k in range(0, 2001, 2)]
    assert np.count_nonzero(np.diff(touches)) >= 4  # two impacts at least
    assert move.energy == pytest.approx(move.energy[0], rel=5e-3)
    assert move[body].velocity[:, :2] == pytest.approx(np.zeros((2001, 2)), abs=1e-9)


def test_colliding_ellipsoids_keep_both_momenta():
    one, first = egg_at((0, 0, 0), (0.2, 0.1, 0.4), velocity=(0.3, 0.1, 0), angular_velocity=(20, -10, 5))
    two, second = egg_at((0.0175, 4e-3, 1e-3), (0.5, -0.3, 0.2), mass=6e-3, velocity=(-0.4, 0.1, 0))
    touch = ms.Contact([first, second], shapes=[first, second], contact_stiffness=2e3)
    scene = ms.Scene([one, two], contacts=[touch], allow_rigid_motions=True)
    move = ms.simulate(scene, steps=100, time_step=1e-4, integrator=ms.TRBDF2(), **EXACT)
    momentum, turning = np.zeros((101, 3)), np.zeros((101, 3))
    for body in (one, two):
        found = move[body]
        inertia = found.rotation @ body.inertia_tensor @ found.rotation.transpose(0, 2, 1)
        momentum += body.mass * found.velocity
        turning += np.einsum("nij,nj->ni", inertia, found.angular_velocity)
        turning += body.mass * np.cross(found.center, found.velocity)
    assert np.abs(move[one].velocity[-1] - move[one].velocity[0]).max() > 0.1
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * MASS
    assert np.abs(turning - turning[0]).max() < 2e-4 * MASS * 0.5 * 0.02
    assert move.energy[-1] == pytest.approx(move.energy[0], rel=1e-3)


def test_box_stands_on_four_corners():
    size = np.array([0.02, 0.01, 0.014])
    mass = 5e-3
    for rounding in (0.0, 2e-3):
        body = ms.RigidBody(
            mass=mass, inertia=mass / 12 * (np.sum(size**2) - size**2), center=(0, 0, size[2] / 2)
        )
        block = ob.Attached(ob.Box(size, rounding, center=(0, 0, size[2] / 2)), to=body)
        touch = ms.Contact(ob.Plane(), shapes=block, contact_stiffness=1e3)
        scene = ms.Scene(body, contacts=[touch], gravity=(0, 0, -G), allow_rigid_motions=True)
        move = ms.simulate(
            scene, steps=300, time_step=1e-3, damping=50.0, integrator=ms.ImplicitEuler(), **EXACT
        )
        state = move.contact_state(touch)
        assert state.normal_forces == pytest.approx(np.full(4, 0.25 * mass * G), rel=1e-4)


def test_pairs_that_touch_at_several_places_are_refused():
    _, egg = egg_at((0, 0, 0.1))
    body = ms.RigidBody(mass=MASS, inertia=1e-7, center=(0, 0, 0.1))
    block = ob.Attached(ob.Box((0.01, 0.01, 0.01), rounding=1e-3), to=body)
    cases = [
        (egg, ob.Box((1, 1, 1)), "give the Box a rounding"),
        (egg, ob.Sphere(1.0, inside=True), "an ellipsoid that a body carries can touch Plane, and solid"),
        (egg, ob.Tube([[0, 0, 0], [1, 0, 0]], radius=0.1), "an ellipsoid that a body carries can touch"),
        (block, ob.Sphere(1.0), "a box that a body carries can touch Plane and hollow Sphere"),
        (block, ob.Box((1, 1, 1)), "use contact of the vertices"),
    ]
    for shape, obstacle, words in cases:
        with pytest.raises(ValueError, match=words):
            ms.Contact(obstacle, shapes=shape)
    assert len(round_pairs([block], [ob.Sphere(1.0, inside=True)])) == 8
