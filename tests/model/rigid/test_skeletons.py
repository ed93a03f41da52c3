"""Skeletons: chains against computed motions, joints against closed forms, gradients against differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from skeleton_chains import chain, differences

import magshell as ms

G = 9.81
# Reference set of the project, cases K1: angles [rad] from the downward vertical and their rates, computed to 1e-21, of
# chains of links of 1 m and 1 kg that start horizontal and at rest; after 3 s the double ones are all but chaotic.
CHAINS = {
    "1rod": {
        0.5: ((-0.09035208996,), (-5.413866991,)),
        1: ((-1.562621718,), (0.4904855313,)),
        2: ((1.538098984,), (-0.9808727419,)),
        3: ((-1.497237955,), (1.470670313,)),
        5: ((-1.366714573,), (2.442236855,)),
        10: ((0.7709576226,), (-4.594396833,)),
    },
    "2rod": {
        0.5: ((0.4481426259, 1.041962887), (-2.414308313, -5.949104936)),
        1: ((-1.207716238, -0.8143910231), (-3.406517533, -0.5160454721)),
        2: ((-0.08275830682, 0.4073620749), (-0.9611454445, 11.89895505)),
        3: ((1.025086012, 0.4957346476), (-4.593357105, 1.184320881)),
    },
    "2point": {
        0.5: ((0.5704720512, 1.203875111), (-2.789645766, -3.188062747)),
        1: ((-0.6250876998, -1.034585086), (-3.922279573, -1.303099249)),
        2: ((-0.4829715343, -1.324048712), (3.065288192, 2.949271548)),
        3: ((1.785795522, 1.118107461), (0.3279806195, -0.5044551039)),
    },
}


def absolute_angles(move, joints, index: int) -> np.ndarray:
    """Return the angles of the links from the downward vertical, in rad."""
    return np.pi / 2 - np.cumsum([move[joint].angle[index] for joint in joints])


def wrapped(angles):
    return (np.asarray(angles) + np.pi) % (2 * np.pi) - np.pi


@pytest.mark.parametrize("case", CHAINS)
def test_chains_move_as_computed_at_second_order(case):
    links, joints = chain(int(case[0]), points=case.endswith("point"))
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    errors, drifts = [], []
    for a_second in (400, 800):
        move = ms.simulate(scene, steps=int(max(CHAINS[case])) * a_second, time_step=1 / a_second)
        off = []
        for t, (angles, rates) in CHAINS[case].items():
            index = int(t * a_second)
            found = -np.cumsum([move[joint].rate[index] for joint in joints])
            off += [*wrapped(absolute_angles(move, joints, index) - angles), *(found - rates)]
        errors.append(np.linalg.norm(off))
        drifts.append(np.abs(move.energy - move.energy[0]).max())
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert drifts[1] < 3e-3  # J, of 15 to 29 that are exchanged
    assert drifts[1] < 0.27 * drifts[0]


def test_joints_hold_to_round_off_over_ten_thousand_steps():
    links, joints = chain(3)
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    move = ms.simulate(scene, steps=10_000, time_step=2e-3, record_every=100)
    assert max(move[joint].gap.max() for joint in joints) < 1e-12
    assert np.abs(np.linalg.norm(move[links[0]].center, axis=1) - 0.5).max() < 1e-12


def test_hinge_in_balance():
    """Compare a rod on a spring hinge with k theta = tau + m g l/2 sin(...), to round-off."""
    rod = ms.Link(mass=2.0, inertia=0.1, center=(0.5, 0, 0))
    hinge = ms.Revolute(
        rod, origin=(0, 0, 0), axis=(0, -1, 0), spring_stiffness=30.0, rest_angle=0.3, torque=4.0
    )
    rest = ms.equilibrium(ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -G)))
    theta = float(rest[hinge].angle)
    assert 30.0 * (theta - 0.3) == pytest.approx(4.0 - 2.0 * G * 0.5 * np.cos(theta), rel=1e-9)


def test_slide_in_balance():
    block = ms.Link(mass=2.0, center=(0, 0, 0), inertia=0.1)
    slide = ms.Prismatic(block, origin=(0, 0, 0), axis=(0, 0, 1), spring_stiffness=100.0, force=5.0)
    rest = ms.equilibrium(ms.Scene(ms.Skeleton([block], [slide]), gravity=(0, 0, -G)))
    assert float(rest[slide].displacement) == pytest.approx((5.0 - 2.0 * G) / 100.0, rel=1e-9)


def test_ball_joint_hangs_and_its_spring_holds():
    bob = ms.Link(mass=1.0, center=(0.6, 0.0, -0.8))
    ball = ms.Ball(bob, origin=(0, 0, 0), spring_stiffness=3.0)
    rest = ms.equilibrium(ms.Scene(ms.Skeleton([bob], [ball]), gravity=(0, 0, -G)))
    angle, start = float(rest[ball].angle), np.arctan2(0.6, 0.8)
    assert 3.0 * angle == pytest.approx(G * np.sin(start - angle), rel=1e-8)


def test_servo_reaches_its_target_within_its_limit():
    rod = ms.Link(mass=1.0, inertia=0.1, center=(0, 0, -0.5))

    def angle(**law):
        hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0), target_angle=1.0, **law)
        return float(ms.equilibrium(ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -G)))[hinge].angle)

    assert angle(servo_stiffness=1e6) == pytest.approx(1.0, abs=1e-5)
    weak = angle(servo_stiffness=1e3, torque_limit=2.0)
    assert G * 0.5 * np.sin(weak) == pytest.approx(2.0, rel=1e-4)


def test_limit_stops_a_falling_rod():
    rod = ms.Link(mass=1.0, inertia=1 / 12, center=(0.5, 0, 0))
    hinge = ms.Revolute(
        rod, origin=(0, 0, 0), axis=(0, 1, 0), upper_limit=0.5, limit_stiffness=1e4, limit_smoothing=1e-3
    )
    scene = ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -G))
    angles = ms.simulate(scene, steps=400, time_step=2.5e-3)[hinge].angle
    assert 0.5 < angles.max() < 0.55
    rest = ms.equilibrium(scene)
    assert 1e4 * (float(rest[hinge].angle) - 0.5 - 5e-4) == pytest.approx(G * 0.5 * np.cos(0.5), rel=1e-2)


def test_slider_crank_closes_its_loop():
    """Compare with case K5, x = r cos t + sqrt(L^2 - r^2 sin^2 t), to 1e-8."""
    r, length, theta = 0.1, 0.3, 1.0
    crank, rod, slider = (
        ms.Link(mass=0.01, inertia=1e-4, center=(r / 2, 0, 0)),
        ms.Link(mass=0.5, inertia=3.75e-3, center=(r + length / 2, 0, 0)),
        ms.Link(mass=1.0, inertia=1e-3, center=(r + length, 0, 0)),
    )
    drive = ms.Revolute(crank, origin=(0, 0, 0), axis=(0, 0, 1), target_angle=theta, servo_stiffness=1e7)
    joints = [
        drive,
        ms.Revolute(rod, crank, origin=(r, 0, 0), axis=(0, 0, 1)),
        ms.Prismatic(slider, origin=(r + length, 0, 0), axis=(1, 0, 0)),
        ms.LoopClosure(rod, slider, origin=(r + length, 0, 0), stiffness=1e6),
    ]
    scene, rest = ms.Scene(ms.Skeleton([crank, rod, slider], joints)), None
    for angle in np.linspace(0, theta, 6)[1:]:
        rest = ms.equilibrium(scene, start=rest, values={drive: {"target_angle": angle}})
    assert float(rest[joints[2]].displacement) + r + length == pytest.approx(0.3419872861, abs=1e-8)
    assert float(rest[joints[3]].gap) < 1e-9


def test_skeleton_in_jelly_keeps_its_bones_and_bends_the_bar():
    mesh = ms.meshes.box((0.4, 0.05, 0.05), cells=(16, 2, 2))
    bar = ms.Solid(
        mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.3), mass_density=1e3, element="linear"
    )
    x = mesh.rest_positions[:, 0]
    bones = [
        ms.Link(vertices=np.flatnonzero((x > a + 1e-9) & (x < b - 1e-9)), body=bar)
        for a, b in ((0.0, 0.18), (0.22, 0.4))
    ]
    elbow = ms.Revolute(bones[1], bones[0], origin=(0.2, 0.025, 0.025), axis=(0, 1, 0), torque=0.05)
    skeleton = ms.Skeleton(bones, [ms.Fixed(bones[0]), elbow])
    rest = ms.equilibrium(ms.Scene([bar, skeleton]))
    assert 0.05 < float(rest[elbow].angle) < 1.5
    for bone in bones:
        now, then = rest[bone].positions, mesh.rest_positions[np.asarray(bone.vertices)]
        lengths = [np.linalg.norm(p - p[:1], axis=1) for p in (now, then)]
        assert np.abs(lengths[0] - lengths[1]).max() < 1e-12


def _held_with_a_velocity(link):
    moving = ms.Link(mass=1.0, center=(0, 0, 0), velocity=(1, 0, 0))
    return ms.Skeleton([link, moving], [ms.Ball(moving, link, origin=(0, 0, 1))])


@pytest.mark.parametrize("driven", [False, True])
def test_links_without_freedom_act_like_pins(driven):
    """Compare links that are fixed, or held by motors, with a soft body pinned there."""
    mesh = ms.meshes.box((0.3, 0.04, 0.04), cells=(6, 1, 1))
    bar = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=2e4, poisson_ratio=0.3), mass_density=1e3)
    x = bar.mesh.rest_positions[:, 0] - bar.mesh.rest_positions[:, 0].min()
    ends = [np.flatnonzero(x < 0.051), np.flatnonzero(x > 0.249)]
    bones = [ms.Link(end, body=bar) for end in ends]
    joints = [
        ms.Revolute(bones[0], origin=(0, 0, 0), axis=(0, 1, 0), motor_angle=0.0)
        if driven
        else ms.Fixed(bones[0]),
        ms.Fixed(bones[1]),
    ]
    skeletons = [ms.Skeleton([bone], [joint]) for bone, joint in zip(bones, joints, strict=True)]
    pull = {"gravity": (0, 0, -G)}
    held = ms.equilibrium(ms.Scene([bar, *skeletons], **pull))
    pinned = ms.equilibrium(ms.Scene(bar, supports=[ms.Pin(np.concatenate(ends))], **pull))
    assert np.abs(pinned.displacements).max() > 1e-4
    np.testing.assert_allclose(held.positions, pinned.positions, atol=1e-12)


def test_gradient_of_a_motion_by_torques_in_time():
    links, joints = chain(2)
    joints = [joint._again({"torque": 0.0, "spring_stiffness": 0.5}) for joint in joints]
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    weights = np.array([0.3, -0.2, 0.7])

    def tip(torque):
        move = ms.simulate(scene, steps=12, time_step=1e-2, values={joints[1]: {"torque": torque}})
        return move[links[1]].center[-1] @ (torch.tensor(weights) if torch.is_tensor(torque) else weights)

    given = np.linspace(-2.0, 3.0, 12)
    torque = torch.tensor(given, requires_grad=True)
    tip(torque).backward()
    np.testing.assert_allclose(torque.grad, differences(tip, given, 3e-2), rtol=2e-6, atol=1e-10)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda a, b: ms.Skeleton([]), "at least one Link"),
        (lambda a, b: ms.Skeleton([a], [ms.Fixed(b)]), "not among the links"),
        (lambda a, b: ms.Skeleton([a, b], [ms.Fixed(a, b), ms.Fixed(b, a)]), "loop"),
        (lambda a, b: ms.Skeleton([a, b], [ms.Fixed(a, b), ms.Fixed(a)]), "two joints lead to one link"),
        (lambda a, b: ms.Revolute(a, origin=(0, 0, 0), axis=(0, 0, 0)), "axis must not be zero"),
        (lambda a, b: ms.Revolute(a, a, origin=(0, 0, 0), axis=(0, 0, 1)), "two links"),
        (lambda a, b: ms.Revolute(a, origin=(0, 0, 0), axis=(0, 0, 1), lower_limit=0.0), "limit_stiffness"),
        (lambda a, b: ms.Revolute(a, origin=(0, 0, 0), axis=(0, 0, 1), target_angle=1.0), "servo_stiffness"),
        (lambda a, b: ms.Ball(a, origin=(0, 0, 0), spring_stiffness=-1.0), "must not be negative"),
        (lambda a, b: ms.Link(mass=1.0), "center"),
        (lambda a, b: _held_with_a_velocity(a), "only that of a free link"),
        (lambda a, b: ms.Scene([ms.Skeleton([a]), a], allow_rigid_motions=True), "one Rigid"),
        (lambda a, b: ms.Scene(ms.Skeleton([ms.Link(mass=1.0, inertia=1.0, center=(0, 0, 0))])), "free"),
        (
            lambda a, b: ms.Scene(ms.Skeleton([a], [ms.Ball(a, origin=(0, 0, 1))])),
            "nothing tells how it turns",
        ),
    ],
)
def test_joints_that_do_not_fit_are_refused(wrong, message):
    a, b = (ms.Link(mass=1.0, center=(0, 0, z)) for z in (1.0, 2.0))
    with pytest.raises(ValueError, match=message):
        wrong(a, b)


def test_a_joint_made_without_a_torque_gets_none_in_a_solve():
    links, joints = chain(1)
    scene = ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G))
    with pytest.raises(ValueError, match="torque"):
        ms.simulate(scene, steps=1, time_step=1e-3, values={joints[0]: {"torque": 1.0}})


def test_link_of_a_closed_surface_has_its_mass_and_inertia():
    box = ms.meshes.box((0.2, 0.3, 0.4), cells=(2, 2, 2))
    link = ms.Link.of(box.surface, mass_density=500.0)
    mass = 500.0 * 0.2 * 0.3 * 0.4
    assert link.mass == pytest.approx(mass, rel=1e-12)
    sides = np.array([0.2, 0.3, 0.4])
    want = mass / 12 * np.diag((sides**2).sum() - sides**2)
    np.testing.assert_allclose(link.inertia, want, atol=1e-12 * mass)
