"""Dynamics of skeletons in joint coordinates against Pinocchio, closed forms, differences and motions."""

from itertools import pairwise

import numpy as np
import pytest
from pinocchio_tables import CHAIN, STATES
from scipy.spatial.transform import Rotation

import magshell as ms

DOWN = (0.0, 0.0, -9.81)


def chain():
    """Build the chain of the tables at zero coordinates; return it with the axes of its ball joint."""
    links, joints = [], []
    frame, origin, ball = np.eye(3), np.zeros(3), np.eye(3)
    for kind, axis, placement, offset, mass, sides, center in CHAIN:
        origin, frame = origin + frame @ offset, frame @ np.array(placement)
        squares = np.square(sides)
        box = frame @ (mass / 12 * np.diag(squares.sum() - squares)) @ frame.T
        link = ms.Link(mass=mass, inertia=box, center=origin + frame @ center)
        ends = {"child": link, "parent": links[-1] if links else None, "origin": origin}
        make = {"revolute": ms.Revolute, "prismatic": ms.Prismatic, "ball": ms.Ball}[kind]
        joints.append(make(**ends, **({} if kind == "ball" else {"axis": frame @ np.array(axis)})))
        ball = frame if kind == "ball" else ball
        links.append(link)
    return ms.Skeleton(links, joints), ball


@pytest.mark.parametrize("state", STATES, ids=["first", "second"])
def test_chain_has_the_mass_matrix_and_accelerations_of_pinocchio(state):
    """Compare in the coordinates of the tables, where a ball turns in the axes of its child."""
    pose, rates, torques, accelerations, mass = map(np.array, state[:5])
    skeleton, ball = chain()
    coordinates, to_world, at = np.zeros(6), np.eye(6), 0
    for joint, own in ms.coordinate_slices(skeleton).items():
        if isinstance(joint, ms.Ball):
            coordinates[own] = ball @ Rotation.from_quat(pose[at : at + 4]).as_rotvec()
            of_ball = own
        else:
            coordinates[own] = pose[at]
        at += 4 if isinstance(joint, ms.Ball) else 1
    to_world[of_ball, of_ball] = turned_frame(skeleton, coordinates, ball, of_ball)
    found = to_world.T @ ms.mass_matrix(skeleton, coordinates) @ to_world
    np.testing.assert_allclose(found, mass, atol=1e-8 * np.abs(mass).max())
    forces = to_world @ torques
    arguments = (skeleton, coordinates, to_world @ rates)
    in_world = ms.forward_dynamics(*arguments, forces, gravity=DOWN)
    # Rates in the axes of the child change as those axes turn with the parent and the child.
    turning = parent_spin(skeleton, coordinates, to_world @ rates, of_ball)
    in_world[of_ball] -= np.cross(turning, (to_world @ rates)[of_ball])
    np.testing.assert_allclose(to_world.T @ in_world, accelerations, atol=1e-7 * np.abs(accelerations).max())
    inverse = ms.inverse_dynamics(
        *arguments, ms.forward_dynamics(*arguments, forces, gravity=DOWN), gravity=DOWN
    )
    np.testing.assert_allclose(inverse, forces, atol=1e-11 * np.abs(forces).max())


def turned_frame(skeleton, coordinates, ball, of_ball):
    """Return the axes of the ball's child in the world."""
    turn = np.eye(3)
    for joint, own in ms.coordinate_slices(skeleton).items():
        vector = coordinates[own] if isinstance(joint, ms.Ball) else coordinates[own] * joint.axis
        if not isinstance(joint, ms.Prismatic):
            turn = turn @ Rotation.from_rotvec(vector).as_matrix()
        if own == of_ball:
            return turn @ ball
    raise AssertionError


def parent_spin(skeleton, coordinates, rates, of_ball):
    """Return the angular velocity of the parent of the ball in the world."""
    turn, spin = np.eye(3), np.zeros(3)
    for joint, own in ms.coordinate_slices(skeleton).items():
        if own == of_ball:
            break
        if isinstance(joint, ms.Revolute):
            spin = spin + rates[own] * (turn @ joint.axis)
            turn = turn @ Rotation.from_rotvec(coordinates[own] * joint.axis).as_matrix()
    return spin


def test_double_pendulum_agrees_with_its_closed_form():
    """Let two point masses hang on rods of 0.7 and 0.4 m, at angles a and a + b from the vertical."""
    m, k, first, second = 1.5, 0.6, 0.7, 0.4
    upper = ms.Link(mass=m, center=(0, 0, -first))
    lower = ms.Link(mass=k, center=(0, 0, -first - second))
    hinges = [
        ms.Revolute(upper, origin=(0, 0, 0), axis=(0, -1, 0)),
        ms.Revolute(lower, upper, origin=(0, 0, -first), axis=(0, -1, 0)),
    ]
    skeleton, (a, b), (u, v) = ms.Skeleton([upper, lower], hinges), (0.4, -1.1), (2.0, 3.0)
    cross = k * first * second * np.cos(b)
    mass = [[(m + k) * first**2 + k * second**2 + 2 * cross, k * second**2 + cross], [0, k * second**2]]
    mass[1][0] = mass[0][1]
    bend = k * first * second * np.sin(b)
    weight = 9.81 * k * second * np.sin(a + b)
    bias = [-bend * v * (2 * u + v) + 9.81 * (m + k) * first * np.sin(a) + weight, bend * u**2 + weight]
    assert ms.mass_matrix(skeleton, (a, b)) == pytest.approx(np.array(mass), rel=1e-12)
    assert ms.bias_forces(skeleton, (a, b), (u, v), gravity=DOWN) == pytest.approx(np.array(bias), rel=1e-12)
    expected = np.linalg.solve(mass, np.array([0.3, -0.2]) - bias)
    found = ms.forward_dynamics(skeleton, (a, b), (u, v), (0.3, -0.2), gravity=DOWN)
    assert found == pytest.approx(expected, rel=1e-11)


def flyer():
    base = ms.Link(mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0.1, 0, 0.2))
    nut = ms.Link(mass=0.7, inertia=(0.02, 0.03, 0.04), center=(0.5, 0.1, 0.2))
    hand = ms.Link(mass=0.4, inertia=0.01, center=(0.9, 0.1, 0.3))
    screw = ms.Screw(nut, base, origin=(0.4, 0, 0.2), axis=(1, 1, 0), pitch=0.05)
    ball = ms.Ball(hand, nut, origin=(0.7, 0.1, 0.2))
    return ms.Skeleton([base, nut, hand], [screw, ball])


def test_free_skeleton_agrees_with_its_motion():
    """Compare accelerations with the change of the rates in short steps of ms.simulate, at rest positions."""
    skeleton = flyer()
    screw, ball = skeleton.joints
    base, nut, hand = skeleton.links
    rates = {
        "velocity": (0.1, 0.2, -0.3),
        "angular_velocity": (1.0, -2.0, 0.5),
    }
    base = ms.Link(mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0.1, 0, 0.2), **rates)
    screw = ms.Screw(nut, base, origin=(0.4, 0, 0.2), axis=(1, 1, 0), pitch=0.05, rate=3.0, torque=0.2)
    ball = ms.Ball(hand, nut, origin=(0.7, 0.1, 0.2), rate=(1.0, 2.0, -1.0), torque=(0.1, -0.2, 0.3))
    skeleton = ms.Skeleton([base, nut, hand], [screw, ball])
    scene = ms.Scene(skeleton, gravity=DOWN, allow_rigid_motions=True)
    slices, found = ms.coordinate_slices(skeleton), []
    assert [type(each) for each in slices] == [ms.Screw, ms.Ball, ms.Link]

    def rates_of(move, k):
        center = move[base]
        own = (
            move[screw].rate[k : k + 1],
            move[ball].rate[k],
            center.velocity[k],
            center.angular_velocity[k],
        )
        return np.concatenate(own)

    for time_step in (4e-3, 2e-3, 1e-3):
        solver = ms.MixedNewton(tolerance=1e-13)
        move = ms.simulate(scene, steps=1, time_step=time_step, solver=solver, progress=False)
        found.append((rates_of(move, 1) - rates_of(move, 0)) / time_step)
    for order in (1, 2):
        found = [(2**order * fine - rough) / (2**order - 1) for rough, fine in pairwise(found)]
    start = rates_of(move, 0)
    forces = np.concatenate([[0.2], [0.1, -0.2, 0.3], np.zeros(6)])
    exact = ms.forward_dynamics(skeleton, np.zeros(10), start, forces, gravity=DOWN)
    np.testing.assert_allclose(found[0], exact, atol=1e-4 * np.abs(exact).max())


def test_mass_matrix_and_bias_make_the_inverse_dynamics():
    skeleton, rng = flyer(), np.random.default_rng(3)
    q, z, a = rng.standard_normal((3, 10))
    mass, bias = ms.mass_matrix(skeleton, q), ms.bias_forces(skeleton, q, z, gravity=DOWN)
    forces = ms.inverse_dynamics(skeleton, q, z, a, gravity=DOWN)
    assert mass @ a + bias == pytest.approx(forces, abs=1e-11 * np.abs(forces).max())
    assert ms.forward_dynamics(skeleton, q, z, forces, gravity=DOWN) == pytest.approx(a, abs=1e-9)
    assert np.linalg.eigvalsh(mass)[0] > 0


def test_bias_keeps_the_power_of_the_kinetic_energy():
    """Compare d(z . M z / 2)/dt at constant rates of one angle and one screw with the power of the bias, by differences."""
    arm = ms.Link(mass=2.0, inertia=(0.1, 0.2, 0.25), center=(0.1, 0, 0.2))
    nut = ms.Link(mass=0.7, inertia=(0.02, 0.03, 0.04), center=(0.5, 0.1, 0.2))
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0.3))
    screw = ms.Screw(nut, arm, origin=(0.4, 0, 0.2), axis=(1, 1, 0), pitch=0.05)
    skeleton = ms.Skeleton([arm, nut], [hinge, screw])
    q, z, step = np.array([0.3, -0.8]), np.array([1.5, -4.0]), 1e-5
    energy = lambda t: 0.5 * z @ ms.mass_matrix(skeleton, q + t * z) @ z  # noqa: E731
    difference = (energy(step) - energy(-step)) / (2 * step)
    assert abs(difference) > 1e-3
    assert z @ ms.bias_forces(skeleton, q, z) == pytest.approx(difference, rel=1e-7)


def test_bad_arguments_are_refused():
    skeleton = flyer()
    zero = np.zeros(10)
    with pytest.raises(ValueError, match=r"skeleton must be a Skeleton, got Link"):
        ms.mass_matrix(skeleton.links[0], zero)
    with pytest.raises(ValueError, match=r"coordinates \[SI\] must have shape \(10,\), got \(3,\)"):
        ms.mass_matrix(skeleton, np.zeros(3))
    with pytest.raises(ValueError, match=r"gravity \[m/s2\] must have shape \(3,\)"):
        ms.bias_forces(skeleton, zero, zero, gravity=9.81)
    bob = ms.Link(center=(1.0, 0, 0))
    massless = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0))])
    with pytest.raises(ValueError, match=r"mass matrix is singular"):
        ms.forward_dynamics(massless, [0.0], [0.0], [0.0])
