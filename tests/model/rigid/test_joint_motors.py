"""Motors that prescribe joints, and moments in ball joints: closed forms, torques, gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skeleton_chains import chain, differences

import magshell as ms

G = 9.81
# Reference set of the project, case K5: a slider-crank driven at 10 rad/s; exact kinematics, torque by energy.
# theta [rad], x [m], dx/dt [m/s], torque of the crank [N m]
SLIDER_CRANK = [
    (0.3, 0.3940745642, -0.3900872232, 0.6234185371),
    (1.0, 0.3419872861, -0.9993586645, 0.5449036572),
    (2.0, 0.2442730249, -0.7769373301, -0.6542316638),
    (3.0, 0.2006686522, -0.09449914937, -0.08940254582),
    (4.5, 0.2625475497, 0.9048786605, 0.6187876649),
]


def arm(motor, **law):
    """Return (scene, hinge, wrist) of a rod of 2 kg and 1 m, level at rest, that a motor turns upwards."""
    rod = ms.Link(mass=2.0, inertia=2.0 / 12, center=(0.5, 0, 0))
    hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, -1, 0), motor_angle=motor, **law)
    hand = ms.Link(mass=0.5, center=(1.2, 0, 0))
    wrist = ms.Revolute(hand, rod, origin=(1, 0, 0), axis=(0, -1, 0), spring_stiffness=5.0, damping=0.3)
    return ms.Scene(ms.Skeleton([rod, hand], [hinge, wrist]), gravity=(0, 0, -G)), hinge, wrist


def test_motor_holds_an_arm_at_its_angle_and_reports_its_torque():
    scene, hinge, wrist = arm(0.7)
    rest = ms.equilibrium(scene)
    assert float(rest[hinge].angle) == pytest.approx(0.7, abs=1e-14)
    reach = np.cos(0.7) + 0.2 * np.cos(0.7 + float(rest[wrist].angle))
    torque = 2.0 * G * 0.5 * np.cos(0.7) + 0.5 * G * reach
    assert float(rest[hinge].motor_torque) == pytest.approx(torque, rel=1e-9)


def test_motor_at_constant_rate_needs_the_static_torque():
    """Compare the torque at a constant rate with the moment of the rod's weight."""
    rod = ms.Link(mass=2.0, inertia=2.0 / 12, center=(0.5, 0, 0))
    hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, -1, 0), motor_angle=0.0, rate=3.0)
    free = ms.Link(mass=1.0, inertia=0.1, center=(5, 0, 0))
    slide = ms.Prismatic(free, origin=(5, 0, 0), axis=(1, 0, 0))
    scene = ms.Scene(ms.Skeleton([rod, free], [hinge, slide]), gravity=(0, 0, -G))
    move = ms.simulate(scene, steps=200, time_step=1e-2, values={hinge: {"motor_angle": lambda t: 3.0 * t}})
    np.testing.assert_allclose(move[hinge].angle, 3.0 * move.times, atol=1e-12)
    assert np.isnan(move[hinge].motor_torque[0])
    want = 2.0 * G * 0.5 * np.cos(3.0 * move.times[1:])
    off = np.abs(move[hinge].motor_torque[1:] - want)
    assert off[20:].max() < 2e-2  # of 9.8: second order in steps of 0.03 rad


def test_force_of_a_sliding_motor_includes_inertia():
    block, bob = ms.Link(mass=2.0, inertia=0.1, center=(0, 0, 0)), ms.Link(mass=1.0, center=(0, 0, -1.0))
    slide = ms.Prismatic(block, origin=(0, 0, 0), axis=(1, 0, 0), motor_displacement=0.0)
    pin = ms.Revolute(bob, block, origin=(0, 0, -1.5), axis=(0, 1, 0), damping=1e5)  # hardly turns
    scene = ms.Scene(ms.Skeleton([block, bob], [slide, pin]))
    move = ms.simulate(
        scene, steps=100, time_step=1e-2, values={slide: {"motor_displacement": lambda t: 0.5 * 4.0 * t**2}}
    )
    assert float(move[slide].displacement[-1]) == pytest.approx(2.0, abs=1e-12)
    assert move[slide].motor_force[-1] == pytest.approx(3.0 * 4.0, rel=1e-2)


def slider_crank():
    r, length = 0.1, 0.3
    crank, rod, slider = (
        ms.Link(center=(r / 2, 0, 0)),
        ms.Link(mass=0.5, inertia=3.75e-3, center=(r + length / 2, 0, 0)),
        ms.Link(mass=1.0, inertia=1e-3, center=(r + length, 0, 0)),
    )
    drive = ms.Revolute(crank, origin=(0, 0, 0), axis=(0, 0, 1), motor_angle=0.0, rate=10.0)
    joints = [
        drive,
        ms.Revolute(rod, crank, origin=(r, 0, 0), axis=(0, 0, 1), rate=-10.0 - 10.0 * r / length),
        ms.Prismatic(slider, origin=(r + length, 0, 0), axis=(1, 0, 0)),
        ms.LoopClosure(rod, slider, origin=(r + length, 0, 0), stiffness=1e11),
    ]
    return ms.Scene(ms.Skeleton([crank, rod, slider], joints)), joints


@pytest.mark.parametrize(("theta", "x", "speed", "torque"), SLIDER_CRANK)
def test_a_driven_slider_crank(theta, x, speed, torque):
    """Compare with case K5: positions at rest to 1e-8, extrapolated speed and torque to 1e-6."""
    scene, (drive, _, slide, _) = slider_crank()
    rest = None
    for angle in np.linspace(0, theta, 2 + int(3 * theta))[1:]:
        rest = ms.equilibrium(scene, start=rest, values={drive: {"motor_angle": angle}})
    assert float(rest[slide].displacement) + 0.4 == pytest.approx(x, abs=1e-8)
    found, squares = [], []
    for a_radian in (40, 50, 60, 70, 80, 100):
        steps = int(a_radian * theta)
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=0.1 * theta / steps,
            values={drive: {"motor_angle": lambda t: 10.0 * t}},
        )
        found.append([float(move[slide].rate[-1]), float(move[drive].motor_torque[-1])])
        squares.append(1.0 / steps**2)
    assert found[-1][0] == pytest.approx(speed, abs=1e-4)
    # Fit by the second and fourth powers of the step, which averages round-off of the closure's force, 1e-6 N m.
    powers = np.vander(squares, 3, increasing=True)
    limit = np.linalg.lstsq(powers / np.abs(powers).max(axis=0), np.array(found), rcond=None)[0][0]
    assert limit == pytest.approx([speed, torque], abs=1e-6)


def test_gradients_by_a_motor_at_rest():
    scene, hinge, wrist = arm(0.7)

    def bent(angle):
        rest = ms.equilibrium(scene, values={hinge: {"motor_angle": angle}})
        return rest[wrist].angle + 0.3 * rest[hinge].angle

    angle = torch.tensor(0.7, dtype=torch.float64, requires_grad=True)
    bent(angle).backward()
    by_hand = differences(lambda a: float(bent(a)), np.array(0.7), 1e-5)
    assert float(angle.grad) == pytest.approx(float(by_hand), rel=1e-7)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()])
def test_gradients_by_a_motor_in_time(integrator):
    scene, hinge, wrist = arm(0.0)
    given = np.sin(np.linspace(0, 1.5, 13))

    def bent(angle):
        move = ms.simulate(
            scene,
            steps=12,
            time_step=2e-2,
            integrator=integrator,
            solver=ms.MixedNewton(tolerance=1e-13),
            values={hinge: {"motor_angle": angle}},
        )
        return move[wrist].angle[-1] + 0.3 * move[hinge].angle[6]

    angle = torch.tensor(given, requires_grad=True)
    bent(angle).backward()
    by_hand = differences(lambda a: float(bent(a)), given, 2e-5)
    np.testing.assert_allclose(angle.grad, by_hand, rtol=1e-5, atol=1e-6)


def test_first_order_response_to_a_motor():
    scene, hinge, wrist = arm(0.7)
    rest = ms.equilibrium(scene)
    near = ms.equilibrium(scene, start=rest, values={hinge: {"motor_angle": 0.7 + 1e-4}})
    angle = torch.tensor(0.7, dtype=torch.float64, requires_grad=True)
    ms.equilibrium(scene, values={hinge: {"motor_angle": angle}})[wrist].angle.backward()
    slope = (float(near[wrist].angle) - float(rest[wrist].angle)) / 1e-4
    assert float(angle.grad) == pytest.approx(slope, rel=1e-3)


def test_a_moment_in_a_ball_joint_keeps_its_direction():
    """Check a bob on a spring ball joint: the angle is m/k about the moment's axis."""
    bob = ms.Link(mass=1.0, inertia=0.1, center=(0, 0, -1.0))
    moment = np.array([0.6, -0.2, 0.9])
    ball = ms.Ball(bob, origin=(0, 0, 0), spring_stiffness=2.0, torque=moment)
    rest = ms.equilibrium(ms.Scene(ms.Skeleton([bob], [ball])))
    size = np.linalg.norm(moment)
    assert float(rest[ball].angle) == pytest.approx(size / 2.0, rel=1e-9)
    np.testing.assert_allclose(rest[bob].rotation @ moment, moment, atol=1e-9)


def test_a_moment_spins_a_ball_and_its_parent_the_other_way():
    ball, base = (ms.Link(mass=1.0, inertia=0.02, center=(x, 0, 0)) for x in (0.0, -0.1))
    joint = ms.Ball(ball, base, origin=(0, 0, 0), torque=(0.01, 0.02, -0.03))
    scene = ms.Scene(ms.Skeleton([ball, base], [joint]), allow_rigid_motions=True)
    move = ms.simulate(scene, steps=20, time_step=1e-2)
    masses = {ball: 0.02, base: 0.02}
    spin = sum(
        inertia * move[link].angular_velocity[-1] + np.cross(move[link].center[-1], move[link].velocity[-1])
        for link, inertia in masses.items()
    )
    np.testing.assert_allclose(spin, 0.0, atol=1e-7)
    assert np.linalg.norm(move[joint].rate[-1]) > 0.3


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_gradient_by_a_moment_in_time():
    links, _ = chain(2)
    joints = [
        ms.Ball(links[0], origin=(0, 0, 0), spring_stiffness=20.0),
        ms.Ball(links[1], links[0], origin=(1, 0, 0), torque=(0, 0, 0), damping=0.1, rate=(0.1, 0.5, 2.0)),
    ]
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    given = np.random.default_rng(3).standard_normal((6, 3))
    weights = np.array([0.3, -0.2, 0.7])

    def tip(torque):
        move = ms.simulate(scene, steps=6, time_step=2e-2, values={joints[1]: {"torque": torque}})
        return move[links[1]].center[-1] @ (
            torch.tensor(weights) if isinstance(torque, type(kept)) else weights
        )

    kept = torch.tensor(given, requires_grad=True)
    tip(kept).backward()
    np.testing.assert_allclose(kept.grad, differences(tip, given, 3e-2), rtol=2e-6, atol=1e-10)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"motor_angle": 1.0, "torque": 1.0}, r"prescribes.*torque"),
        ({"motor_angle": 1.0, "target_angle": 1.0, "servo_stiffness": 1.0}, "servo_stiffness"),
        ({"motor_angle": np.nan}, "motor_angle"),
        ({"motor_angle": (1.0, 2.0)}, "motor_angle"),
    ],
)
def test_bad_motors_are_refused(law, message):
    rod = ms.Link(mass=1.0, inertia=0.1, center=(0.5, 0, 0))
    with pytest.raises(ValueError, match=message):
        ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0), **law)


def test_motor_torque_of_a_free_joint_raises_an_error():
    scene, _, wrist = arm(0.1)
    with pytest.raises(ValueError, match="motor_angle"):
        ms.equilibrium(scene)[wrist].motor_torque  # noqa: B018
