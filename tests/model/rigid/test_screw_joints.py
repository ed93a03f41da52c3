"""Screws: closed forms of equilibria and motions, full turns, starts, and gradients by the pitch."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skeleton_chains import differences

import magshell as ms

G = 9.81
PITCH = 0.02  # m/rad


def nut(**law):
    """Return (scene, screw, link) of a nut of 2 kg and 0.1 kg m2 on an upright screw."""
    link = ms.Link(mass=2.0, inertia=0.1, center=(0, 0, 0))
    screw = ms.Screw(link, origin=(0, 0, 0), axis=(0, 0, 2.0), **{"pitch": PITCH, **law})
    return ms.Scene(ms.Skeleton([link], [screw]), gravity=(0, 0, -G)), screw, link


def test_screw_in_balance_over_many_turns():
    """Compare the angle on a spring with k s = -m g h, which is three turns and a half."""
    scene, screw, link = nut(spring_stiffness=2.0 * G * PITCH / 22.0)
    rest = ms.equilibrium(scene)
    assert float(rest[screw].angle) == pytest.approx(-22.0, rel=1e-9)
    assert float(rest[screw].displacement) == pytest.approx(-22.0 * PITCH, rel=1e-9)
    np.testing.assert_allclose(rest[link].center, (0, 0, -22.0 * PITCH), atol=1e-12)
    np.testing.assert_allclose(rest[link].rotation[0, 0], np.cos(22.0), atol=1e-8)


@pytest.mark.parametrize("pitch", [PITCH, -0.5, 3e-4])
def test_a_nut_runs_down_its_screw(pitch):
    """Compare the motion with the angular acceleration -m g h / (I + m h^2)."""
    scene, screw, _ = nut(pitch=pitch, rate=2.0)
    acceleration = -2.0 * G * pitch / (0.1 + 2.0 * pitch**2)
    errors = []
    for steps in (200, 400):
        move = ms.simulate(scene, steps=steps, time_step=1.0 / steps)
        angle = 2.0 * move.times + 0.5 * acceleration * move.times**2
        np.testing.assert_allclose(move[screw].displacement, pitch * move[screw].angle, atol=1e-12)
        off = (move[screw].angle - angle, move[screw].rate - 2.0 - acceleration * move.times)
        errors.append([np.abs(each).max() / np.abs(angle).max() for each in off])
    assert np.max(errors[1]) < 5e-3
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 2.0, atol=0.15)


def test_motor_lifts_by_full_turns_and_reports_its_torque():
    scene, screw, link = nut(motor_angle=20.0)
    rest = ms.equilibrium(scene)
    assert float(rest[link].center[2]) == pytest.approx(20.0 * PITCH, abs=1e-13)
    assert float(rest[screw].angle) == pytest.approx(20.0, abs=1e-12)
    assert float(rest[screw].motor_torque) == pytest.approx(2.0 * G * PITCH, rel=1e-9)


def test_servo_holds_a_load_within_its_limits():
    scene, screw, _ = nut(target_angle=5.0, servo_stiffness=40.0, damping=0.1)
    assert 40.0 * (5.0 - float(ms.equilibrium(scene)[screw].angle)) == pytest.approx(
        2.0 * G * PITCH, rel=1e-8
    )
    scene, screw, _ = nut(lower_limit=-1.0, limit_stiffness=1e3, limit_smoothing=1e-4)
    depth = -1.0 - float(ms.equilibrium(scene)[screw].angle)
    assert depth == pytest.approx(2.0 * G * PITCH / 1e3 + 5e-5, rel=1e-4)


@pytest.mark.parametrize("turned", [-30.0, 55.0])
def test_spring_counts_all_turns_of_one_solve(turned):
    """Check the angle and the energy of a nut whose weight and spring are in balance after several turns."""
    stiffness = 0.02
    rest_angle = turned + 2.0 * G * PITCH / stiffness
    scene, screw, _ = nut(spring_stiffness=stiffness, rest_angle=rest_angle)
    found = ms.equilibrium(scene)
    assert float(found[screw].angle) == pytest.approx(turned, rel=1e-8)
    assert found.energies["joints"] == pytest.approx(0.5 * stiffness * (turned - rest_angle) ** 2, rel=1e-8)


def train(**first):
    """Return (scene, joints, links) of a screw on a screw on a free link, with a rod on a hinge at the end."""
    links = [
        ms.Link(mass=1.0 + k, inertia=(0.02, 0.03, 0.04), center=(0.2 * k, 0.05 * k, 0.1 * (k % 2)))
        for k in range(4)
    ]
    joints = [
        ms.Screw(
            links[1],
            links[0],
            origin=(0.1, 0, 0),
            axis=(1, 0.3, 0.2),
            **{"pitch": 0.1, "rate": 3.0, "spring_stiffness": 2.0, "damping": 0.05, **first},
        ),
        ms.Screw(links[2], links[1], origin=(0.3, 0.1, 0), axis=(0, 1, 1), pitch=-0.07, rate=-2.0),
        ms.Revolute(links[3], links[2], origin=(0.5, 0.1, 0), axis=(0, 1, 0), rate=1.0),
    ]
    return ms.Scene(ms.Skeleton(links, joints), allow_rigid_motions=True), joints, links


def test_a_train_of_screws_keeps_its_momenta_and_its_threads():
    scene, joints, links = train(damping=0.0, spring_stiffness=0.0)

    def moved(steps):
        move = ms.simulate(scene, steps=steps, time_step=1.0 / steps)
        masses = [link.mass for link in links]
        momentum = sum(m * move[link].velocity for m, link in zip(masses, links, strict=True))
        return move, np.abs(momentum - momentum[0]).max(), np.abs(move.energy - move.energy[0]).max()

    (coarse, momentum, lost), (fine, _, less) = moved(100), moved(200)
    assert momentum < 1e-9
    assert np.log2(lost / less) > 1.7
    for joint, pitch in zip(joints[:2], (0.1, -0.07), strict=True):
        for move in (coarse, fine):
            np.testing.assert_allclose(move[joint].displacement, pitch * move[joint].angle, atol=1e-12)
            np.testing.assert_allclose(move[joint].gap, np.abs(move[joint].displacement), atol=1e-12)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()], ids=repr)
def test_gradients_of_a_train_of_screws(integrator):
    """Compare gradients by pitches, axes, origins and rates with differences, in motion."""
    scene, joints, links = train()
    names = [(joints[0], "pitch"), (joints[1], "pitch"), (joints[0], "axis"), (joints[1], "axis")]
    names += [(joints[0], "origin"), (joints[1], "origin"), (joints[0], "rate"), (joints[1], "rate")]

    def loss(*given):
        values = {}
        for (joint, name), value in zip(names, given, strict=True):
            values.setdefault(joint, {})[name] = value
        move = ms.simulate(
            scene,
            steps=60,
            time_step=0.05,
            integrator=integrator,
            values=values,
            solver=EXACT,
            progress=False,
        )
        end = move[links[3]]
        return (end.center[-1] * torch.tensor([1.0, -2.0, 0.5])).sum() + end.rotation[-1][0, 1]

    at = [
        torch.tensor(getattr(joint, name), dtype=torch.float64, requires_grad=True) for joint, name in names
    ]
    loss(*at).backward()
    for k, value in enumerate(at):

        def along(one, k=k):
            given = [each.detach() for each in at]
            return loss(*given[:k], torch.tensor(one, requires_grad=True), *given[k + 1 :]).item()

        numbers = value.detach().numpy()
        long, short = (differences(along, np.array(numbers), step) for step in (2e-4, 1e-4))
        exact = (4.0 * short - long) / 3.0
        assert np.abs(exact).max() > 1e-3
        np.testing.assert_allclose(value.grad, exact, rtol=1e-6, atol=1e-6 * np.abs(exact).max())


EXACT = ms.MixedNewton(tolerance=1e-12)


def test_changed_pitch_equals_a_scene_made_with_it():
    law = {"spring_stiffness": 0.5, "torque": 0.3}
    scene, screw, link = nut(**law)
    other, _, made = nut(pitch=0.1, **law)
    replaced = ms.equilibrium(scene, values={screw: {"pitch": 0.1}})
    fresh = ms.equilibrium(other)
    assert replaced[link].center[2] == pytest.approx(fresh[made].center[2], abs=1e-13)
    assert float(replaced[screw].angle) == pytest.approx((0.3 - 2.0 * G * 0.1) / 0.5, rel=1e-9)


def test_a_motion_goes_on_only_with_the_pitch_of_its_start():
    scene, screw, _ = nut(rate=40.0)
    first = ms.simulate(scene, steps=20, time_step=1e-2)
    later = ms.simulate(scene, steps=20, time_step=1e-2, start=first.end)
    whole = ms.simulate(scene, steps=40, time_step=1e-2)
    assert float(later[screw].displacement[-1]) == pytest.approx(
        float(whole[screw].displacement[-1]), abs=1e-10
    )
    with pytest.raises(ValueError, match="start had another"):
        ms.simulate(scene, steps=1, time_step=1e-2, start=first.end, values={screw: {"pitch": 0.03}})


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"pitch": 0.0}, "must not be zero"),
        ({"pitch": np.nan}, "pitch"),
        ({"pitch": (1.0, 2.0)}, "pitch"),
        ({"pitch": None}, "pitch"),
        ({"motor_angle": 1.0, "torque": 1.0}, r"prescribes.*torque"),
        ({"motor_displacement": 1.0}, "motor_displacement"),
    ],
)
def test_bad_screws_are_refused(law, message):
    with pytest.raises((ValueError, TypeError), match=message):
        nut(**law)
