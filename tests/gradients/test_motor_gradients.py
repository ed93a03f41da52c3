"""Gradients of motor forces in joints, in equilibria and in motions, against differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skeleton_chains import differences

import magshell as ms

G = 9.81
WEIGHTS = np.array([0.7, -1.3, 0.4])


def robot():
    """Build a robot: a motor slides the base, a ball joint has a motor, and two hinges have a spring and a motor."""
    base = ms.Link(mass=1.0, inertia=0.2, center=(0, 0, 0))
    arm = ms.Link(mass=2.0, inertia=(0.2, 0.3, 0.25), center=(0.5, 0.1, 0))
    hand = ms.Link(mass=0.5, inertia=(0.02, 0.05, 0.04), center=(1.2, 0.1, 0.1))
    finger = ms.Link(mass=0.2, inertia=0.01, center=(1.5, 0.2, 0.1))
    slide = ms.Prismatic(base, origin=(0, 0, 0), axis=(1, 0.3, 0), motor_displacement=0.1)
    hinge = ms.Revolute(
        arm, base, origin=(0, 0, 0), axis=(0.2, -1, 0.1), motor_angle=0.3, spring_stiffness=2.0, damping=0.2
    )
    wrist = ms.Revolute(hand, arm, origin=(1, 0, 0), axis=(0, -0.5, 1), spring_stiffness=15.0, damping=0.3)
    ball = ms.Ball(finger, hand, origin=(1.4, 0.1, 0.1), motor_rotation=(0.2, -0.4, 0.3))
    skeleton = ms.Skeleton([base, arm, hand, finger], [slide, hinge, wrist, ball])
    return ms.Scene(skeleton, gravity=(0, 0, -G)), slide, hinge, wrist, ball


def motor_output(result, prismatic, hinge, ball):
    """Return a number to which all motors contribute; for a motion, at some of its states."""
    weights = WEIGHTS if isinstance(result[hinge].motor_torque, np.ndarray) else torch.tensor(WEIGHTS)
    sums = (
        0.3 * result[prismatic].motor_force
        + result[hinge].motor_torque ** 2
        + (result[ball].motor_torque * weights).sum(-1) * (1.0 + result[hinge].motor_torque)
    )
    return sums if sums.ndim == 0 else sums[3] + 0.5 * sums[4] + 2.0 * sums[-1]


VALUES = {
    "slide axis": ("slide", "axis", np.array([1, 0.3, 0]) / np.hypot(1, 0.3)),
    "hinge angle": ("hinge", "motor_angle", 0.3),
    "hinge axis": ("hinge", "axis", np.array([0.2, -1, 0.1]) / np.linalg.norm([0.2, -1, 0.1])),
    "hinge origin": ("hinge", "origin", np.zeros(3)),
    "hinge spring": ("hinge", "spring_stiffness", 2.0),
    "wrist axis": ("wrist", "axis", np.array([0, -0.5, 1]) / np.hypot(0.5, 1)),
    "wrist origin": ("wrist", "origin", np.array([1.0, 0, 0])),
    "wrist spring": ("wrist", "spring_stiffness", 15.0),
    "ball rotation": ("ball", "motor_rotation", np.array([0.2, -0.4, 0.3])),
    "ball origin": ("ball", "origin", np.array([1.4, 0.1, 0.1])),
}


def varied(solve, given, step=1e-5):
    """Return the gradient of `solve`, and the one by differences; for unit vectors the part perpendicular to them."""
    value = torch.tensor(given, dtype=torch.float64, requires_grad=True)
    solve(value).backward()
    by_hand = differences(lambda each: float(solve(each)), np.asarray(given, dtype=np.float64), step)
    return value.grad.numpy(), by_hand


@pytest.mark.parametrize("which", VALUES)
def test_motor_outputs_of_an_equilibrium(which):
    scene, slide, hinge, wrist, ball = robot()
    owner = {"slide": slide, "hinge": hinge, "wrist": wrist, "ball": ball}[VALUES[which][0]]

    def solve(value):
        values = {owner: {VALUES[which][1]: value}}
        return motor_output(
            ms.equilibrium(scene, values=values, solver=ms.MixedNewton(tolerance=1e-13)), slide, hinge, ball
        )

    found, by_hand = varied(solve, VALUES[which][2])
    np.testing.assert_allclose(found, by_hand, rtol=1e-7, atol=1e-6 * np.abs(by_hand).max() + 1e-8)


def test_motor_outputs_by_gravity_together_with_other_outputs():
    scene, slide, hinge, wrist, ball = robot()

    def solve(gravity):
        rest = ms.equilibrium(scene, values={scene: {"gravity": gravity}})
        return motor_output(rest, slide, hinge, ball) + rest[wrist].angle + rest[ball].place[2]

    found, by_hand = varied(solve, np.array([0.3, 0.2, -G]), 1e-4)
    np.testing.assert_allclose(found, by_hand, rtol=1e-7)


def motion(scene, hinge, ball, integrator, values, **law):
    steps = 8
    times = np.linspace(0, 1, steps + 1)
    values = {
        hinge: {"motor_angle": 0.3 + 0.5 * np.sin(2.0 * times)},
        ball: {"motor_rotation": np.outer(1 + times**2, [0.2, -0.4, 0.3])},
        **values,
    }
    return ms.simulate(
        scene,
        steps=steps,
        time_step=law.pop("time_step", 2e-2),
        integrator=integrator,
        values=values,
        solver=ms.MixedNewton(tolerance=1e-13),
        **law,
    )


@pytest.mark.parametrize("keep", ["factors", "checkpoints"])
@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()])
def test_motor_outputs_of_a_motion_by_their_signals(integrator, keep):
    scene, slide, hinge, _, ball = robot()
    given = 0.3 + 0.5 * np.sin(np.linspace(0, 2.0, 9))

    def solve(angles):
        values = {hinge: {"motor_angle": angles}}
        return motor_output(
            motion(scene, hinge, ball, integrator, values, adjoint_storage=keep), slide, hinge, ball
        )

    found, by_hand = varied(solve, given, 1e-5)
    np.testing.assert_allclose(found, by_hand, rtol=1e-6, atol=1e-7 * np.abs(by_hand).max())


@pytest.mark.parametrize(
    ("which", "step"),
    [
        ("hinge axis", 1e-5),
        ("hinge origin", 1e-5),
        ("wrist axis", 1e-4),
        ("wrist spring", 1e-3),
        ("ball origin", 1e-5),
    ],
)
def test_motor_outputs_of_a_motion(which, step):
    scene, slide, hinge, wrist, ball = robot()
    owner = {"hinge": hinge, "wrist": wrist, "ball": ball}[VALUES[which][0]]

    def solve(value):
        moved = {owner: {VALUES[which][1]: value}}
        signal = 0.3 + 0.5 * np.sin(np.linspace(0, 2.0, 9))
        if owner is hinge:
            moved[hinge]["motor_angle"] = signal
        if owner is ball:
            moved[ball]["motor_rotation"] = np.outer(1 + np.linspace(0, 1, 9) ** 2, [0.2, -0.4, 0.3])
        return motor_output(motion(scene, hinge, ball, ms.TRBDF2(), moved), slide, hinge, ball)

    found, by_hand = varied(solve, VALUES[which][2], step)
    np.testing.assert_allclose(found, by_hand, rtol=1e-6, atol=1e-6 * np.abs(by_hand).max())


def test_motor_outputs_by_the_time_step():
    scene, slide, hinge, _, ball = robot()

    def solve(time_step):
        move = motion(scene, hinge, ball, ms.TRBDF2(), {}, time_step=time_step, record_every=2)
        return 0.3 * move[slide].motor_force[-1] + move[hinge].motor_torque[2] * move[hinge].motor_torque[-1]

    found, by_hand = varied(solve, 2e-2, 1e-7)
    assert float(found) == pytest.approx(float(by_hand), rel=1e-5)


def fleshy():
    """Build a soft bar around two bones; a motor rotates the upper one."""
    mesh = ms.meshes.box((0.04, 0.04, 0.3), cells=(1, 1, 6))
    bar = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
    )
    z = mesh.rest_positions[:, 2]
    upper = ms.Link(vertices=np.flatnonzero(z > 0.19), body=bar)
    lower = ms.Link(vertices=np.flatnonzero(z < 0.11), body=bar)
    shoulder = ms.Revolute(upper, origin=(0.02, 0.02, 0.3), axis=(0, 1, 0), motor_angle=0.0)
    elbow = ms.Revolute(lower, upper, origin=(0.02, 0.02, 0.15), axis=(0, 1, 0), damping=1e-3)
    skeleton = ms.Skeleton([upper, lower], [shoulder, elbow])
    return ms.Scene([bar, skeleton], gravity=(0, 0, -G)), shoulder, elbow


@pytest.mark.parametrize(
    ("name", "given", "step"),
    [
        ("stiffness_damping", 5e-3, 1e-6),
        ("damping", 0.05, 1e-4),
        ("maxwell_modulus", (0.5, 0.2), 1e-4),
        ("maxwell_time", (0.1, 0.4), 1e-4),
        ("young_modulus", 2e4, 1.0),
        ("mass_density", 1e3, 0.1),
        ("elbow", 1e-3, 1e-5),
    ],
)
def test_motor_outputs_in_a_soft_body(name, given, step):
    """Check that the history of damping contributes as well as the end of a step."""
    scene, shoulder, elbow = fleshy()
    laws = {"stiffness_damping": 5e-3, "damping": 0.05}
    laws |= {"maxwell_modulus": (0.5, 0.2), "maxwell_time": (0.1, 0.4)}
    angles = 0.4 * np.sin(np.linspace(0, 2, 7))

    def solve(value):
        now, values = dict(laws), {shoulder: {"motor_angle": angles}}
        if name == "elbow":
            values[elbow] = {"damping": value}
        elif name in laws:
            now[name] = value
        else:
            values[scene.bodies[0]] = {name: value}
        move = ms.simulate(
            scene, steps=6, time_step=1e-2, values=values, solver=ms.MixedNewton(tolerance=1e-13), **now
        )
        torque = move[shoulder].motor_torque
        return torque[2] * torque[-1] + 0.1 * move[elbow].angle[-1]

    found, by_hand = varied(solve, given, step)
    np.testing.assert_allclose(found, by_hand, rtol=1e-5)


@pytest.mark.parametrize("budget", [1e9, 1.0])
def test_power_of_a_motor(budget):
    """Differentiate the sum of squares of the torque along a path with few parameters, as for a motion of low
    effort.
    """
    scene, _, hinge, _, ball = robot()
    shape = torch.linspace(0, 1, 9, dtype=torch.float64)

    def solve(given):
        angles = 0.3 + given[0] * shape**2 + given[1] * shape**3
        keep = ms.AdjointStorage(memory_budget=budget)
        move = motion(scene, hinge, ball, ms.TRBDF2(), {hinge: {"motor_angle": angles}}, adjoint_storage=keep)
        return (move[hinge].motor_torque[1:] ** 2).sum()

    given = torch.tensor([0.4, -0.2], dtype=torch.float64, requires_grad=True)
    solve(given).backward()
    by_hand = differences(lambda g: float(solve(torch.tensor(g))), np.array([0.4, -0.2]), 1e-5)
    np.testing.assert_allclose(given.grad.numpy(), by_hand, rtol=1e-6)
