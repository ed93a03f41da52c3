"""Dampers in joints: closed forms, order in time, dissipated energy, rotations past full circles, gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skeleton_chains import chain, differences

import magshell as ms

G = 9.81


def wheel(**law):
    """Return (scene, joint) of a rotor about z with an inertia of 0.02 kg m2."""
    rotor = ms.Link(mass=1.0, inertia=(0.01, 0.01, 0.02), center=(0, 0, 0))
    axle = ms.Revolute(rotor, origin=(0, 0, 0), axis=(0, 0, 1), **law)
    return ms.Scene(ms.Skeleton([rotor], [axle])), axle


@pytest.mark.parametrize(
    ("integrator", "order", "rate"), [(ms.TRBDF2(), 2, 8.0), (ms.ImplicitEuler(), 1, 0.2)]
)
def test_damped_wheel_slows_down_exponentially(integrator, order, rate):
    """Compare with theta = w0 I/d (1 - exp(-d t/I)) from I w' = -d w, over several full circles in one case."""
    scene, axle = wheel(damping=0.005, rate=rate)
    exact = rate * 0.02 / 0.005 * (1 - np.exp(-0.005 * 2.5 / 0.02))
    errors = []
    for steps in (400, 800):
        move = ms.simulate(scene, steps=steps, time_step=2.5 / steps, integrator=integrator)
        errors.append(abs(float(move[axle].angle[-1]) - exact))
    assert order == 1 or exact > 4 * np.pi
    assert errors[1] < 2e-3 * exact
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_a_stiff_damper_holds_over_long_steps():
    """Check a damper 100,000 times faster than the step: the wheel stops at once and does not spring back."""
    scene, axle = wheel(damping=2e3, rate=40.0)
    move = ms.simulate(scene, steps=20, time_step=0.1)
    assert np.abs(move[axle].angle).max() < 1e-3
    assert np.abs(move[axle].rate[-1]) < 1e-6


def test_a_damped_double_pendulum_in_space_is_of_second_order():
    def moved(steps):
        links, _ = chain(2)
        joints = [
            ms.Revolute(links[0], origin=(0, 0, 0), axis=(0.3, 1, 0.2), damping=0.4),
            ms.Ball(links[1], links[0], origin=(1, 0, 0), damping=0.2, rate=(1.0, 0.5, 2.0)),
        ]
        scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
        move = ms.simulate(scene, steps=steps, time_step=0.8 / steps)
        assert (np.diff(move.energy) < 1e-4).all() and move.energy[-1] < move.energy[0] - 1.0
        return move[links[1]].center[-1]

    rough, middle, fine = (moved(steps) for steps in (40, 80, 160))
    order = np.log2(np.linalg.norm(middle - rough) / np.linalg.norm(fine - middle))
    assert order == pytest.approx(2.0, abs=0.2)


def test_a_damped_slide_is_the_oscillator():
    block = ms.Link(mass=2.0, center=(0, 0, 0), inertia=0.1)
    slide = ms.Prismatic(
        block, origin=(0, 0, 0), axis=(1, 1, 0), spring_stiffness=50.0, damping=4.0, rate=0.3
    )
    move = ms.simulate(ms.Scene(ms.Skeleton([block], [slide])), steps=400, time_step=2.5e-3)
    decay = 4.0 / (2 * 2.0)
    omega = np.sqrt(50.0 / 2.0 - decay**2)
    exact = 0.3 / omega * np.exp(-decay * move.times) * np.sin(omega * move.times)
    np.testing.assert_allclose(move[slide].displacement, exact, atol=2e-5)


def test_a_ball_damper_takes_momentum_from_a_spinning_ball():
    """Compare a ball of isotropic inertia with I w' = -d w about any axis."""
    ball = ms.Link(mass=1.0, inertia=0.02, center=(0, 0, 0))
    socket = ms.Ball(ball, origin=(0, 0, 0), damping=0.05, rate=(3.0, -20.0, 10.0))
    move = ms.simulate(ms.Scene(ms.Skeleton([ball], [socket])), steps=800, time_step=1.25e-3)
    exact = np.array([3.0, -20.0, 10.0]) * np.exp(-0.05 / 0.02 * move.times)[:, None]
    np.testing.assert_allclose(move[socket].rate, exact, atol=3e-3)


def test_equilibrium_ignores_dampers():
    links, joints = chain(1)
    joints = [joint._again({"spring_stiffness": 30.0, "damping": 5.0}) for joint in joints]
    without = [joint._again({"spring_stiffness": 30.0}) for joint in joints]
    angles = [
        float(ms.equilibrium(ms.Scene(ms.Skeleton(links, each), gravity=(0, 0, -G)))[each[0]].angle)
        for each in (joints, without)
    ]
    assert angles[0] == angles[1]


def test_gradient_by_damping_in_time_and_past_full_turns():
    scene, axle = wheel(damping=0.0, rate=40.0, torque=0.1)
    steps = 20
    given = np.linspace(0.01, 0.06, steps)

    def turned(damping):
        move = ms.simulate(scene, steps=steps, time_step=0.02, values={axle: {"damping": damping}})
        return move[axle].angle[-1]

    damping = torch.tensor(given, requires_grad=True)
    angle = turned(damping)
    assert float(angle.detach()) > 2 * np.pi
    angle.backward()
    np.testing.assert_allclose(damping.grad, differences(turned, given, 1e-4), rtol=1e-5)


def test_continued_damped_motion_has_the_same_bits():
    links, joints = chain(2)
    joints = [joint._again({"damping": 0.3}) for joint in joints]
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    whole = ms.simulate(scene, steps=10, time_step=1e-2)
    first = ms.simulate(scene, steps=4, time_step=1e-2)
    rest = ms.simulate(scene, steps=6, time_step=1e-2, start=first.end)
    assert (whole[links[1]].center[-1] == rest[links[1]].center[-1]).all()


def test_damping_must_not_be_negative():
    rod = ms.Link(mass=1.0, inertia=0.1, center=(0.5, 0, 0))
    with pytest.raises(ValueError, match=r"damping.*must not be negative"):
        ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0), damping=-1.0)
