"""Skeletons without soft bodies in vibrations, paths, buckling and linear response, or a clear refusal."""

from __future__ import annotations

import numpy as np
import pytest

import magshell as ms
from magshell.model.scene.solve_inputs import plain_inputs
from magshell.solve.linear.rest import RestStiffness, forces_at_rest

G = 9.81


def double_pendulum(up: bool = False, second: dict | None = None, **first):
    """Return (scene, joints) of two rods of 1 m and 1 kg that hang on hinges about y, or stand on them."""
    sign = 1.0 if up else -1.0
    rods = [ms.Link(mass=1.0, inertia=1 / 12, center=(0, 0, sign * (0.5 + k))) for k in range(2)]
    joints = [
        ms.Revolute(rods[0], origin=(0, 0, 0), axis=(0, 1, 0), **first),
        ms.Revolute(rods[1], rods[0], origin=(0, 0, sign), axis=(0, 1, 0), **(second or {})),
    ]
    return ms.Scene(ms.Skeleton(rods, joints), gravity=(0, 0, -G)), joints


def stiffness_and_mass(spring: float):
    """Return the stiffness of springs and of weight, and the mass, in the angles from the vertical."""
    weight = G * np.diag([1.5, 0.5])
    springs = spring * np.array([[2.0, -1.0], [-1.0, 1.0]])
    return springs, weight, np.array([[4 / 3, 0.5], [0.5, 1 / 3]])


def test_double_pendulum_has_the_closed_form_frequencies():
    scene, _ = double_pendulum(spring_stiffness=3.0, second={"spring_stiffness": 3.0})
    modes = ms.vibration_modes(scene, ms.equilibrium(scene), count=1)
    springs, weight, mass = stiffness_and_mass(3.0)
    lowest = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, springs + weight)).min()) / (2 * np.pi)
    assert modes.frequencies[0] == pytest.approx(lowest, rel=1e-9)


def test_standing_rods_on_springs_buckle_under_their_weight():
    scene, _ = double_pendulum(True, spring_stiffness=30.0, second={"spring_stiffness": 30.0})
    springs, weight, _ = stiffness_and_mass(30.0)
    critical = np.linalg.eigvals(np.linalg.solve(weight, springs)).min()
    assert ms.linear_buckling(scene, gravity_factor=1.0).factors[0] == pytest.approx(critical, rel=1e-4)


def test_a_path_follows_a_torque_and_a_motor():
    scene, joints = double_pendulum(spring_stiffness=30.0, torque=0.0, second={"motor_angle": 0.0})
    path = ms.follow_path(scene, values={joints[0]: {"torque": 4.0}, joints[1]: {"motor_angle": 0.8}})
    rest = ms.equilibrium(scene, values={joints[0]: {"torque": 4.0}, joints[1]: {"motor_angle": 0.8}})
    for joint in joints:
        assert float(path[joint].angle[-1]) == pytest.approx(float(rest[joint].angle), abs=1e-8)


def test_moment_in_a_ball_joint_is_refused_by_linear_theory():
    bob = ms.Link(mass=1.0, inertia=0.1, center=(0, 0, -1.0))
    ball = ms.Ball(bob, origin=(0, 0, 0), spring_stiffness=2.0, torque=(0.6, -0.2, 0.9))
    scene = ms.Scene(ms.Skeleton([bob], [ball]), gravity=(0, 0, -G))
    with pytest.raises(ValueError, match="torque of a Ball or of a rigid body has no potential"):
        ms.vibration_modes(scene, ms.equilibrium(scene), count=1)
    path = ms.follow_path(scene, gravity_factor=1.0)
    found = path.equilibrium(-1)
    assert path.parameters[-1] == 1.0 and found.stable
    np.testing.assert_allclose(found[bob].rotation, ms.equilibrium(scene)[bob].rotation, rtol=0, atol=1e-9)


def test_skeleton_fully_held_by_motors_has_no_vibrations():
    scene, joints = double_pendulum(motor_angle=0.4, second={"motor_angle": 0.3})
    rest = ms.equilibrium(scene)
    assert [float(rest[joint].angle) for joint in joints] == pytest.approx([0.4, 0.3], abs=1e-14)
    with pytest.raises(ValueError, match="0 degrees of freedom"):
        ms.vibration_modes(scene, rest, count=1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda bar, x: _two(bar, x < 0.21, x > 0.19), "share vertex"),
        (
            lambda bar, x: ms.Link(mass=1.0, inertia=(1.0, 0.1, 0.1), center=(0, 0, 0)),
            "no body has the inertia",
        ),
        (lambda bar, x: ms.Link(mass=-1.0, center=(0, 0, 0)), r"mass.*must be positive"),
    ],
)
def test_links_that_cannot_be(make, message):
    mesh = ms.meshes.box((0.4, 0.05, 0.05), cells=(8, 1, 1))
    bar = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.3), element="linear")
    with pytest.raises(ValueError, match=message):
        make(bar, mesh.rest_positions[:, 0])


def _two(bar, first, second):
    a, b = (ms.Link(vertices=np.flatnonzero(each), body=bar) for each in (first, second))
    joints = [ms.Fixed(a), ms.Revolute(b, a, origin=(0.2, 0, 0), axis=(0, 1, 0))]
    return ms.Scene([bar, ms.Skeleton([a, b], joints)])


@pytest.mark.parametrize(
    "pull",
    [
        {"spring_stiffness": 30.0, "torque": 1e-3},
        {"spring_stiffness": 30.0, "rest_angle": 1e-4},
        {"target_angle": 1e-4, "servo_stiffness": 20.0},
        {"lower_limit": 1e-4, "limit_stiffness": 30.0, "limit_smoothing": 1e-5},
        {"motor_angle": 1e-4},
    ],
    ids=lambda law: next(iter(reversed(law))),
)
def test_linear_theory_includes_forces_in_joints(pull):
    """Compare with an equilibrium under loads so small that it is linear."""
    scene, joints = double_pendulum(True, spring_stiffness=30.0, second=pull)
    solved = ms.equilibrium(scene, gravity_factor=0.0, solver=ms.MixedNewton(tolerance=1e-13))
    inputs = plain_inputs(scene, None, None, None, gravity_factor=0.0)
    at_rest = forces_at_rest(inputs)
    with inputs.in_core():
        linear = RestStiffness(inputs).response(inputs, at_rest)
    change = solved._state - scene._model.rest_state()
    assert np.abs(change).max() > 1e-5
    assert float(solved[joints[1]].angle) == pytest.approx(
        1e-3 / 30.0 if "torque" in pull else 1e-4, rel=1e-1
    )
    # A limit ends where it is left, while its tangent continues.
    allowed = 0.06 if "lower_limit" in pull else 1e-3
    np.testing.assert_allclose(linear, change, atol=allowed * np.abs(change).max())
    with pytest.raises(ValueError, match=r"acts whatever they are"):
        ms.linear_buckling(scene)
