"""Changed origins of joints: links stay at their rest positions; gradients by origins."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms

WEIGHT, ARM, SPRING = 2.0 * 9.81, 0.3, 8.0  # N, m, N m/rad


def _flap():
    rod = ms.Link(mass=2.0, inertia=0.01, center=(ARM, 0, 0))
    hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=SPRING)
    return ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -9.81)), hinge


def test_a_flap_hangs_by_its_lever_and_so_does_the_gradient():
    scene, hinge = _flap()
    origin = torch.tensor([0.05, 0.0, 0.0], dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(scene, values={hinge: {"origin": origin}}, solver=ms.MixedNewton(tolerance=1e-12))
    lever = ARM - 0.05
    angle = rest[hinge].angle.item()
    assert angle * SPRING == pytest.approx(WEIGHT * lever * np.cos(angle), rel=1e-9)
    rest[hinge].angle.backward()
    slope = -WEIGHT * np.cos(angle) / (SPRING + WEIGHT * lever * np.sin(angle))
    # With the hinge higher by z, the rod lies z below it; that adds z sin(angle) to the lever.
    upright = WEIGHT * np.sin(angle) / (SPRING + WEIGHT * lever * np.sin(angle))
    assert origin.grad[0].item() == pytest.approx(slope, rel=1e-7)
    assert abs(origin.grad[1].item()) < 1e-12
    assert abs(origin.grad[2].item()) == pytest.approx(upright, rel=1e-7)


def test_changed_origin_equals_a_scene_made_with_it():
    place = (0.06, 0.01, -0.02)
    other = ms.Link(mass=2.0, inertia=0.01, center=(ARM, 0, 0))
    there = ms.Revolute(other, origin=place, axis=(0, 1, 0), spring_stiffness=SPRING, rate=3.0)
    made = ms.Scene(ms.Skeleton([other], [there]), gravity=(0, 0, -9.81))
    changed = ms.Link(mass=2.0, inertia=0.01, center=(ARM, 0, 0))
    moved = ms.Revolute(changed, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=SPRING, rate=3.0)
    given = ms.Scene(ms.Skeleton([changed], [moved]), gravity=(0, 0, -9.81))
    options = {"steps": 20, "time_step": 5e-3, "progress": False}
    a = ms.simulate(made, **options)
    b = ms.simulate(given, values={moved: {"origin": place}}, **options)
    np.testing.assert_allclose(b[changed].center, a[other].center, atol=1e-9)


def _arm_in_flesh():
    """Return a scene of two links in a soft bar, on a hinge and a ball joint."""
    mesh = ms.meshes.box((0.06, 0.01, 0.01), cells=(6, 1, 1))
    solid = ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.4), mass_density=1e3, element="linear"
    )
    x = mesh.rest_positions[:, 0]
    x = x - x.min()
    first, second = (
        ms.Link(np.flatnonzero(np.abs(x - at) < 1e-6), body=solid, mass=1e-3, inertia=1e-7)
        for at in (0.02, 0.04)
    )
    corner = mesh.rest_positions.min(axis=0)
    hinge = ms.Revolute(
        first, origin=np.add(corner, (0.012, 0.005, 0.006)), axis=(0.1, 1, 0), spring_stiffness=1e-4
    )
    ball = ms.Ball(
        second, first, origin=np.add(corner, (0.03, 0.004, 0.005)), spring_stiffness=1e-4, damping=1e-6
    )
    pinned = ms.Pin(np.flatnonzero(x < 1e-6))
    scene = ms.Scene(
        [solid, ms.Skeleton([first, second], [hinge, ball])], supports=[pinned], gravity=(0, 1, -9.81)
    )
    return scene, hinge, ball


def test_gradient_in_flesh_over_200_steps():
    scene, hinge, ball = _arm_in_flesh()
    way = np.random.default_rng(5).standard_normal((2, 3))
    weights = torch.tensor(
        np.random.default_rng(6).standard_normal(scene.bodies[0].mesh.rest_positions.shape)
    )

    def end(shift, tensors=False):
        given = {
            joint: {"origin": torch.tensor(joint.origin + shift * each, requires_grad=tensors)}
            for joint, each in zip((hinge, ball), way, strict=True)
        }
        move = ms.simulate(
            scene,
            steps=200,
            time_step=1e-3,
            values=given,
            solver=ms.MixedNewton(tolerance=1e-11),
            progress=False,
        )
        return (weights * move.positions[-1]).sum(), [each["origin"] for each in given.values()]

    loss, origins = end(0.0, tensors=True)
    loss.backward()
    along = sum(float(origin.grad @ torch.tensor(each)) for origin, each in zip(origins, way, strict=True))
    step = 1e-5
    a, b, c, d = (end(k * step)[0].item() for k in (-2, -1, 1, 2))
    difference = (8 * (c - b) - (d - a)) / (12 * step)
    assert along == pytest.approx(difference, rel=1e-5)


def test_a_motion_does_not_go_on_from_other_joints():
    scene, hinge = _flap()
    rest = ms.equilibrium(scene, values={hinge: {"origin": (0.05, 0.0, 0.01)}})
    options = {"steps": 2, "time_step": 1e-3, "progress": False}
    with pytest.raises(ValueError, match="another origin"):
        ms.simulate(scene, start=rest, **options)
    move = ms.simulate(scene, start=rest, values={hinge: {"origin": (0.05, 0.0, 0.01)}}, **options)
    assert np.abs(move[hinge].angle - float(rest[hinge].angle)).max() < 1e-9


def test_start_follows_the_changed_origin_of_a_motor():
    """Check that a start follows a motor to its new origin, although no force depends on it."""
    arm, tool = (ms.Link(mass=m, inertia=0.01, center=(x, 0, 0)) for m, x in ((2.0, ARM), (0.5, 0.6)))
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=SPRING)
    motor = ms.Revolute(tool, arm, origin=(0.5, 0, 0), axis=(0, 0, 1), motor_angle=0.4)
    scene = ms.Scene(
        ms.Skeleton([arm, tool], [hinge, motor])
    )  # no weight: only the motor depends on the origin
    rest = ms.equilibrium(scene)
    moved = {motor: {"origin": (0.45, 0.02, 0.0)}}
    fresh = ms.equilibrium(scene, values=moved)[tool].center
    assert np.abs(fresh - rest[tool].center).max() > 5e-3
    np.testing.assert_allclose(
        ms.equilibrium(scene, values=moved, start=rest)[tool].center, fresh, atol=1e-12
    )
