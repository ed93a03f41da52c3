"""Ball joints: limits of their axis, servos and motors for their rotation."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms
from magshell.model.supports.supports import rotation_matrix

G = 9.81
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12)}


def _bob(**law):
    """Return (scene, joint, link) of one kilogram on an arm of half a meter that is level at rest."""
    bob = ms.Link(mass=1.0, inertia=0.02, center=(0.5, 0, 0))
    ball = ms.Ball(bob, origin=(0, 0, 0), **law)
    return ms.Scene(ms.Skeleton([bob], [ball]), gravity=(0, 0, -G)), ball, bob


def test_an_arm_leans_on_its_cone():
    """Compare the limit's moment with the weight's moment m g l cos(s).

    The limit is a parabola up to its smoothing, then linear. It does not resist twist, which only the spring holds.
    """
    stiffness, smoothing, cone = 200.0, 1e-3, 0.4
    law = {"axis": (1, 0, 0), "cone_limit": cone, "limit_stiffness": stiffness, "limit_smoothing": smoothing}
    scene, ball, bob = _bob(spring_stiffness=1e-3, **law)
    rest = ms.equilibrium(scene, **EXACT)
    arm = rest[bob].rotation[:, 0]
    lean = np.arccos(arm[0])
    assert arm[2] < 0 and abs(arm[1]) < 1e-9
    depth = lean - cone - 0.5 * smoothing
    spring = 1e-3 * float(rest[ball].angle)
    assert stiffness * depth + spring == pytest.approx(G * 0.5 * np.cos(lean), rel=1e-6)
    scene, twisted, bone = _bob(spring_stiffness=1e-3, torque=(1e-3, 0.0, 0.0), **law)
    found = ms.equilibrium(scene, gravity_factor=0.0)
    assert float(found[twisted].angle) == pytest.approx(
        1.0, rel=1e-9
    )  # 57 degrees of twist, which the cone does not resist
    np.testing.assert_allclose(found[bone].rotation[:, 0], (1, 0, 0), atol=1e-9)


def test_cone_limit_exerts_no_moment_inside():
    inside, *_, bob = _bob(
        spring_stiffness=30.0, axis=(1, 0, 0), cone_limit=0.4, limit_stiffness=1e3, limit_smoothing=1e-2
    )
    without, *_, other = _bob(spring_stiffness=30.0)
    a, b = ms.equilibrium(inside, **EXACT)[bob], ms.equilibrium(without, **EXACT)[other]
    np.testing.assert_allclose(a.center, b.center, atol=1e-13)


def test_a_whirling_arm_stays_in_its_cone():
    scene, _, bob = _bob(
        axis=(1, 0, 0), cone_limit=0.5, limit_stiffness=500.0, limit_smoothing=1e-2, rate=(9.0, 3.0, -4.0),
    )  # fmt: skip
    move = ms.simulate(scene, steps=200, time_step=2e-3, progress=False)
    lean = np.arccos(np.clip(move[bob].rotation[:, 0, 0], -1, 1))
    # Rotation and fall have 5.8 J to press it into the limit.
    assert 0.5 < lean.max() < 0.5 + 0.005 + np.sqrt(2 * 5.8 / 500.0)
    assert abs(move.energy[-1] - move.energy[0]) < 2e-3 * move.kinetic_energy.max()


def test_a_servo_turns_to_its_target_with_a_torque_below_its_limit():
    target = np.array([0.3, -0.5, 0.4])
    scene, ball, bob = _bob(target_rotation=target, servo_stiffness=1e4)
    rest = ms.equilibrium(scene)
    np.testing.assert_allclose(rest[bob].rotation, rotation_matrix(target), atol=1e-3)
    # Without weight it reaches the target; a weak servo misses it by what the weight requires.
    level, ball, bob = _bob(target_rotation=(0, 0, 0), servo_stiffness=50.0, torque_limit=6.0)
    rest = ms.equilibrium(level, **EXACT)
    angle = float(rest[ball].angle)
    torque = 50.0 * angle / np.hypot(1.0, 50.0 * angle / 6.0)
    assert torque == pytest.approx(G * 0.5 * np.cos(angle), rel=1e-9) and torque < 6.0


def test_a_servo_on_a_turned_parent_and_its_gradient():
    """Check a servo whose target's axes move with the parent, reached and not reached.

    Gradients by target, gain and limit are compared with differences.
    """
    base, hand = (
        ms.Link(mass=1.0, inertia=0.02, center=(0.5, 0, 0)),
        ms.Link(mass=0.4, inertia=0.01, center=(1.2, 0.1, 0)),
    )
    hinge = ms.Revolute(base, origin=(0, 0, 0), axis=(0.2, 1, 0), spring_stiffness=9.0)
    ball = ms.Ball(
        hand, base, origin=(1, 0, 0), target_rotation=(0, 0, 0), servo_stiffness=5.0, torque_limit=2.0
    )

    def value(gravity, **law):
        scene = ms.Scene(ms.Skeleton([base, hand], [hinge, ball]), gravity=gravity)
        found = ms.equilibrium(scene, values={ball: law}, **EXACT)
        relative = found[base].rotation.swapaxes(-1, -2) @ found[hand].rotation
        ways = torch.as_tensor(np.random.default_rng(1).standard_normal((3, 3)))
        return found, (torch.as_tensor(relative) * ways).sum()

    given = {"target_rotation": np.array([0.5, -0.8, 0.3]), "servo_stiffness": 5.0, "torque_limit": 2.0}
    found, _ = value((0, 0, 0), **given)
    relative = found[base].rotation.T @ found[hand].rotation
    np.testing.assert_allclose(relative, rotation_matrix(given["target_rotation"]), atol=1e-9)
    for gravity in ((0, 0, 0), (0.5, 0.3, -G)):
        tensors = {
            name: torch.tensor(each, dtype=torch.float64, requires_grad=True) for name, each in given.items()
        }
        value(gravity, **tensors)[1].backward()
        for name, each in given.items():
            way = np.ones(np.shape(each)) / 3.0
            a, b, c, d = (
                float(value(gravity, **{**given, name: each + k * 1e-3 * way})[1]) for k in (-2, -1, 1, 2)
            )
            by_hand = (8 * (c - b) - (d - a)) / 12e-3
            assert float((tensors[name].grad * torch.tensor(way)).sum()) == pytest.approx(
                by_hand, rel=1e-7, abs=1e-8
            )


def test_motor_holds_a_rotation_and_reports_its_moment():
    turn = np.array([0.3, 0.9, -0.4])
    scene, ball, bob = _bob(motor_rotation=turn)
    rest = ms.equilibrium(scene)
    np.testing.assert_allclose(rest[bob].rotation, rotation_matrix(turn), atol=1e-14)
    arm = rotation_matrix(turn) @ (0.5, 0, 0)
    np.testing.assert_allclose(rest[ball].motor_torque, -np.cross(arm, (0, 0, -G)), atol=1e-10)
    assert rest[ball].motor_torque.shape == (3,)


def test_a_motor_beyond_half_a_turn_goes_the_shorter_way():
    scene, _, bob = _bob(motor_rotation=(0.0, 0.0, 2.0 * np.pi - 0.5))
    np.testing.assert_allclose(ms.equilibrium(scene)[bob].rotation, rotation_matrix((0, 0, -0.5)), atol=1e-13)


def test_motor_moment_in_time_is_that_of_inertia():
    """Compare a motor's moment about an axis of inertia with inertia times angular acceleration.

    There is no gravity; Euler's equations give the moment where the axis rotates.
    """
    top = ms.Link(mass=1.0, inertia=(0.02, 0.03, 0.04), center=(0, 0, 0))
    ball = ms.Ball(top, origin=(0, 0, 0), motor_rotation=(0, 0, 0))
    scene = ms.Scene(ms.Skeleton([top], [ball]))

    def torque(steps):
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=0.4 / steps,
            values={ball: {"motor_rotation": lambda t: np.array([0.0, 0.0, 3.0]) * t**2}},
            progress=False,
        )
        return move, move[ball].motor_torque

    move, found = torque(40)
    np.testing.assert_allclose(move[top].rotation[-1], rotation_matrix((0, 0, 0.48)), atol=1e-13)
    np.testing.assert_allclose(found[-1], (0, 0, 6.0 * 0.04), atol=1e-3)
    assert np.isnan(found[0]).all()


def test_gradient_by_a_motor_in_time():
    """Check a motor that moves the ball joint of the next link: the gradient by its rotations at the ends of steps."""
    links = [
        ms.Link(mass=1.0, inertia=0.02, center=(0.5, 0, 0)),
        ms.Link(mass=0.5, inertia=0.02, center=(1, 0, 0)),
        ms.Link(mass=0.3, inertia=0.01, center=(1.5, 0.1, 0)),
    ]
    joints = [
        ms.Revolute(links[0], origin=(0, 0, 0), axis=(0.1, 1, 0), spring_stiffness=20.0),
        ms.Ball(links[1], links[0], origin=(0.8, 0, 0), motor_rotation=(0, 0, 0)),
        ms.Ball(links[2], links[1], origin=(1.3, 0, 0), spring_stiffness=5.0, damping=0.01),
    ]
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    given = np.cumsum(0.1 * np.random.default_rng(3).standard_normal((7, 3)), axis=0)
    given -= given[0]
    weights = np.random.default_rng(4).standard_normal((2, 3))

    def value(rotations):
        move = ms.simulate(
            scene,
            steps=6,
            time_step=2e-2,
            values={joints[1]: {"motor_rotation": rotations}},
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        centers = [move[link].center[-1] for link in links[1:]]
        return sum(
            (torch.as_tensor(c) * torch.as_tensor(w)).sum() for c, w in zip(centers, weights, strict=True)
        )

    kept = torch.tensor(given, requires_grad=True)
    value(kept).backward()
    way = np.random.default_rng(5).standard_normal(given.shape)
    way[0] = 0.0
    a, b, c, d = (float(value(given + k * 1e-3 * way)) for k in (-2, -1, 1, 2))
    assert float((kept.grad * torch.tensor(way)).sum()) == pytest.approx(
        (8 * (c - b) - (d - a)) / 12e-3, rel=1e-6
    )


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"cone_limit": 0.5, "limit_stiffness": 1.0, "limit_smoothing": 0.1}, "both axis and cone_limit"),
        ({"axis": (1, 0, 0)}, "both axis and cone_limit"),
        ({"axis": (1, 0, 0), "cone_limit": 0.5}, "needs limit_stiffness"),
        (
            {"axis": (1, 0, 0), "cone_limit": 3.2, "limit_stiffness": 1.0, "limit_smoothing": 0.1},
            r"cone_limit \[rad\] of a Ball must be from 1e-3 to pi",
        ),
        ({"axis": (0, 0, 0), "cone_limit": 0.5}, "axis must not be zero"),
        ({"target_rotation": (0, 0, 1)}, "needs both target_rotation and servo_stiffness"),
        ({"servo_stiffness": 1.0}, "needs both target_rotation and servo_stiffness"),
        ({"motor_rotation": 1.0}, r"motor_rotation"),
        ({"motor_rotation": (0, 0, np.inf)}, "motor_rotation"),
        ({"motor_rotation": (0, 0, 1), "torque": (0, 0, 1)}, r"prescribes.*torque"),
    ],
)
def test_bad_ball_joints(law, message):
    bob = ms.Link(mass=1.0, inertia=0.1, center=(0.5, 0, 0))
    with pytest.raises(ValueError, match=message):
        ms.Ball(bob, origin=(0, 0, 0), **law)
