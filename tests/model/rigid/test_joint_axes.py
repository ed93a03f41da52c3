"""Changed axes of joints, origins of slides and loop closures: links stay at their rest positions; gradients."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import magshell as ms

G = 9.81
EXACT = {"solver": ms.MixedNewton(tolerance=1e-12)}


def _flap(axis=(0.0, 1.0, 0.0)):
    rod = ms.Link(mass=2.0, inertia=0.01, center=(0.3, 0, 0))
    hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=axis, spring_stiffness=8.0)
    return ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -G)), hinge, rod


def _difference(value, at, direction, step=1e-4):
    a, b, c, d = (value(at + k * step * direction) for k in (-2, -1, 1, 2))
    return (8 * (c - b) - (d - a)) / (12 * step)


def test_a_flap_about_a_leaning_axis():
    """Compare with the closed form: about an axis tilted by b, gravity acts with the factor cos b."""
    scene, hinge, _ = _flap()
    lean = 0.6
    axis = torch.tensor([0.0, np.cos(lean), np.sin(lean)], dtype=torch.float64, requires_grad=True)
    rest = ms.equilibrium(scene, values={hinge: {"axis": axis}}, **EXACT)
    angle = rest[hinge].angle
    assert 8.0 * angle.item() == pytest.approx(2 * G * 0.3 * np.cos(angle.item()) * np.cos(lean), rel=1e-9)
    angle.backward()
    pull = 2 * G * 0.3
    slope = pull * np.cos(angle.item()) / (8.0 + pull * np.sin(angle.item()) * np.cos(lean))
    across = np.array([0.0, -np.sin(lean), np.cos(lean)])
    assert float(axis.grad @ axis.detach()) == pytest.approx(0.0, abs=1e-12)
    # d(cos b) = - sin b db along `across`
    assert float(axis.grad.numpy() @ across) == pytest.approx(-slope * np.sin(lean), rel=1e-7)


def test_length_of_an_axis_does_not_matter():
    scene, hinge, rod = _flap()
    found = []
    for length in (1.0, 4.0):
        axis = torch.tensor([0.1 * length, length, -0.2 * length], dtype=torch.float64, requires_grad=True)
        rest = ms.equilibrium(scene, values={hinge: {"axis": axis}}, **EXACT)
        rest[rod].center.sum().backward()
        found.append((rest[rod].center.detach().numpy(), length * axis.grad.numpy()))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12)
    with pytest.raises(ValueError, match="axis must not be zero"):
        ms.equilibrium(scene, values={hinge: {"axis": (0.0, 0.0, 0.0)}})
    with pytest.raises(ValueError, match=r"axis .*\(3,\)"):
        ms.equilibrium(scene, values={hinge: {"axis": (0.0, 1.0)}})


def test_changed_axis_equals_a_scene_made_with_it():
    """Check positions, angles and rates of a hinge with a slide behind it, both with new axes, and a damper."""

    def made(first, second):
        arm, sled = (ms.Link(mass=m, inertia=0.01, center=(x, 0, 0)) for m, x in ((2.0, 0.3), (0.5, 0.6)))
        hinge = ms.Revolute(
            arm, origin=(0, 0, 0), axis=first, spring_stiffness=8.0, rate=2.0, damping=0.05, lower_limit=-0.1,
            limit_stiffness=10.0, limit_smoothing=0.1,
        )  # fmt: skip
        slide = ms.Prismatic(
            sled, arm, origin=(0.5, 0, 0), axis=second, spring_stiffness=90.0, rate=0.4, damping=0.1
        )
        return ms.Scene(ms.Skeleton([arm, sled], [hinge, slide]), gravity=(0, 0, -G)), hinge, slide, sled

    axes = (0.3, 1.0, 0.4), (1.0, 0.5, -0.3)
    one, *same = made(*axes)
    other, hinge, slide, sled = made((0, 1, 0), (1, 0, 0))
    options = {"steps": 20, "time_step": 1e-2, "progress": False}
    a = ms.simulate(one, **options)
    b = ms.simulate(other, values={hinge: {"axis": axes[0]}, slide: {"axis": axes[1]}}, **options)
    np.testing.assert_allclose(b[sled].center, a[same[2]].center, atol=1e-10)
    np.testing.assert_allclose(b[hinge].angle, a[same[0]].angle, atol=1e-9)
    np.testing.assert_allclose(b[hinge].rate, a[same[0]].rate, atol=1e-7)
    np.testing.assert_allclose(b[slide].displacement, a[same[1]].displacement, atol=1e-9)
    np.testing.assert_allclose(b[slide].rate, a[same[1]].rate, atol=1e-7)


def _arm_in_flesh():
    """Return a scene of links in a soft bar: a hinge, a slide along an oblique axis, and a ball joint behind them."""
    mesh = ms.meshes.box((0.08, 0.01, 0.01), cells=(8, 1, 1))
    solid = ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.4), mass_density=1e3, element="linear"
    )
    x = mesh.rest_positions[:, 0] - mesh.rest_positions[:, 0].min()
    bones = [
        ms.Link(np.flatnonzero(np.abs(x - at) < 1e-6), body=solid, mass=1e-3, inertia=1e-7)
        for at in (0.02, 0.04, 0.06)
    ]
    corner = mesh.rest_positions.min(axis=0)
    hinge = ms.Revolute(
        bones[0], origin=np.add(corner, (0.012, 0.005, 0.006)), axis=(0.1, 1, 0.4), spring_stiffness=1e-4
    )
    slide = ms.Prismatic(
        bones[1], bones[0], origin=np.add(corner, (0.03, 0, 0)), axis=(1, 0.2, -0.3), spring_stiffness=1.0,
        damping=1e-3,
    )  # fmt: skip
    ball = ms.Ball(
        bones[2], bones[1], origin=np.add(corner, (0.05, 0.004, 0.005)), spring_stiffness=1e-4, damping=1e-6
    )
    pinned = ms.Pin(np.flatnonzero(x < 1e-6))
    skeleton = ms.Skeleton(bones, [hinge, slide, ball])
    scene = ms.Scene([solid, skeleton], supports=[pinned], gravity=(0, 1, -G))
    return scene, hinge, slide


def test_gradient_by_axes_in_flesh_over_200_steps():
    scene, hinge, slide = _arm_in_flesh()
    rng = np.random.default_rng(5)
    ways = rng.standard_normal((2, 3))
    weights = torch.tensor(rng.standard_normal(scene.bodies[0].mesh.rest_positions.shape))

    def end(shift, tensors=False):
        given = {
            joint: {"axis": torch.tensor(joint.axis + shift * direction, requires_grad=tensors)}
            for joint, direction in zip((hinge, slide), ways, strict=True)
        }
        move = ms.simulate(
            scene,
            steps=200,
            time_step=1e-3,
            values=given,
            solver=ms.MixedNewton(tolerance=1e-11),
            progress=False,
        )
        return (weights * move.positions[-1]).sum(), [each["axis"] for each in given.values()]

    loss, axes = end(0.0, tensors=True)
    loss.backward()
    along = sum(
        float(axis.grad @ torch.tensor(direction)) for axis, direction in zip(axes, ways, strict=True)
    )
    difference = _difference(lambda shift: end(shift)[0].item(), 0.0, 1.0, 1e-3)
    assert along == pytest.approx(difference, rel=1e-5)


def test_origins_of_slides_and_fixed_joints_have_no_effect():
    """Check that origins of a slide and a fixed joint change nothing, and that their gradients are zero."""
    arm, sled, tool = (ms.Link(mass=0.5, inertia=0.01, center=(x, 0, 0)) for x in (0.3, 0.6, 0.7))
    hinge = ms.Revolute(arm, origin=(0, 0, 0), axis=(0, 1, 0), spring_stiffness=8.0)
    slide = ms.Prismatic(sled, arm, origin=(0.5, 0, 0), axis=(1, 0, 0.3), spring_stiffness=90.0)
    weld = ms.Fixed(tool, sled)
    scene = ms.Scene(ms.Skeleton([arm, sled, tool], [hinge, slide, weld]), gravity=(0, 0, -G))
    there = {
        joint: {"origin": torch.tensor([0.1, -0.2, 0.3], dtype=torch.float64, requires_grad=True)}
        for joint in (slide, weld)
    }
    as_it_is, moved = ms.equilibrium(scene), ms.equilibrium(scene, values=there)
    np.testing.assert_allclose(moved[tool].center.detach(), as_it_is[tool].center, atol=1e-12)
    moved[tool].center.sum().backward()
    for named in there.values():
        assert np.abs(named["origin"].grad.numpy()).max() == 0.0


def test_gradient_by_the_origin_of_a_loop_closure():
    """Check a beam on two springs, one of them a loop closure that pulls less the further out it is."""
    beam = ms.Link(mass=2.0, inertia=0.1, center=(0.5, 0, 0))
    hinge = ms.Revolute(beam, origin=(0, 0, 0), axis=(0, 1, 0))
    loop = ms.LoopClosure(beam, origin=(0.8, 0, 0), stiffness=200.0)
    scene = ms.Scene(ms.Skeleton([beam], [hinge, loop]), gravity=(0, 0, -G))

    def angle(origin):
        return ms.equilibrium(scene, values={loop: {"origin": origin}}, **EXACT)[hinge].angle

    origin = torch.tensor([0.8, 0.0, 0.1], dtype=torch.float64, requires_grad=True)
    found = angle(origin)
    # k |R o - o|^2 / 2 = k |o|^2 (1 - cos a)
    lever = 200.0 * (0.8**2 + 0.1**2)
    assert lever * np.sin(found.item()) == pytest.approx(2 * G * 0.5 * np.cos(found.item()), rel=1e-9)
    found.backward()
    by_hand = [
        _difference(lambda at: float(angle(at)), origin.detach().numpy(), direction, 1e-3)
        for direction in np.eye(3)
    ]
    np.testing.assert_allclose(origin.grad, by_hand, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("integrator", [ms.TRBDF2(), ms.ImplicitEuler()], ids=repr)
def test_gradient_by_axes_and_origins_of_a_thrown_chain(integrator):
    """Check axes and origins in a motion with initial rates, a loop closure and a motor, together and one by one."""
    links = [
        ms.Link(mass=m, inertia=0.02, center=c) for m, c in ((1.0, (0.5, 0, 0)), (0.4, (1, 0, 0.3)), (0.3, (1.2, 0.4, 0.1)))
    ]  # fmt: skip
    joints = [
        ms.Revolute(links[0], origin=(0, 0, 0), axis=(0, 1, 0.2), rate=3.0, spring_stiffness=1.0),
        ms.Prismatic(links[1], links[0], origin=(1, 0, 0), axis=(0.2, 0, 1), rate=0.5, spring_stiffness=60.0),
        ms.Revolute(links[2], links[1], origin=(1, 0.1, 0), axis=(1, 0.2, 0), motor_angle=0.0),
        ms.LoopClosure(links[0], origin=(0.7, 0, 0), stiffness=30.0),
    ]
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    weights = np.random.default_rng(2).standard_normal((3, 3))
    turning = np.linspace(0, 0.5, 9) ** 2

    def end(parameters):
        values = {joint: {name: value} for (joint, name), value in parameters.items()}
        values[joints[2]]["motor_angle"] = turning
        move = ms.simulate(
            scene,
            steps=8,
            time_step=2e-2,
            values=values,
            integrator=integrator,
            solver=ms.MixedNewton(tolerance=1e-13),
            progress=False,
        )
        centers = [move[link].center[-1] for link in links]
        ways = weights if isinstance(centers[0], np.ndarray) else torch.tensor(weights)
        return sum((center * direction).sum() for center, direction in zip(centers, ways, strict=True))

    keys = [*((joint, "axis") for joint in joints[:3]), (joints[3], "origin")]
    given = {key: np.array(getattr(*key)) for key in keys}
    tensors = {key: torch.tensor(value, requires_grad=True) for key, value in given.items()}
    end(tensors).backward()
    rng = np.random.default_rng(7)
    for key, value in given.items():
        direction = rng.standard_normal(3)
        by_hand = _difference(lambda at, key=key: float(end({**given, key: at})), value, direction, 3e-3)
        assert float(tensors[key].grad @ torch.tensor(direction)) == pytest.approx(
            by_hand, rel=2e-6, abs=1e-9
        )


def test_a_motion_does_not_go_on_from_another_axis():
    scene, hinge, _ = _flap()
    leaning = {hinge: {"axis": (0.0, 1.0, 0.5)}}
    rest = ms.equilibrium(scene, values=leaning)
    options = {"steps": 2, "time_step": 1e-3, "progress": False}
    with pytest.raises(ValueError, match="another origin or axis"):
        ms.simulate(scene, start=rest, **options)
    move = ms.simulate(scene, start=rest, values=leaning, **options)
    assert np.abs(move[hinge].angle - float(rest[hinge].angle)).max() < 1e-9


def test_gradient_by_the_axis_of_a_damped_joint_behind_a_fast_one():
    """Check steps so long that velocities are no rotation about the axis alone, which the damper's rate includes."""
    arm, hand = (
        ms.Link(mass=m, inertia=(0.02, 0.03, 0.04), center=(x, 0.1, 0)) for m, x in ((2.0, 0.5), (0.5, 1.2))
    )
    shoulder = ms.Revolute(arm, origin=(0, 0, 0), axis=(0.2, -1, 0.1), rate=6.0)
    wrist = ms.Revolute(
        hand, arm, origin=(1, 0, 0), axis=(0, -0.5, 1), spring_stiffness=15.0, damping=0.3, rate=-5.0
    )
    slide_hand = ms.Link(mass=0.3, inertia=0.01, center=(1.5, 0.1, 0.2))
    slide = ms.Prismatic(
        slide_hand, hand, axis=(1, 0.2, 0.4), origin=(1.4, 0, 0), spring_stiffness=40.0, damping=2.0
    )
    scene = ms.Scene(ms.Skeleton([arm, hand, slide_hand], [shoulder, wrist, slide]), gravity=(0, 0, -G))

    def end(axis, joint):
        move = ms.simulate(
            scene, steps=8, time_step=2e-2, values={joint: {"axis": axis}}, progress=False, **EXACT
        )
        return move[slide_hand].center[-1].sum() + move[arm].center[4, 0]

    for joint in (wrist, slide):
        given = np.array(joint.axis)
        axis = torch.tensor(given, requires_grad=True)
        end(axis, joint).backward()
        by_hand = np.array(
            [(float(end(given + h, joint)) - float(end(given - h, joint))) / 2e-4 for h in 1e-4 * np.eye(3)]
        )
        np.testing.assert_allclose(axis.grad.numpy(), by_hand, rtol=1e-5, atol=1e-6 * np.abs(by_hand).max())
