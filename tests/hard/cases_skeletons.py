"""Skeletons: at limits, past poles, whips of fifty links, mass ratios of a million, torques far too strong."""

from __future__ import annotations

import numpy as np
from answers import both, holds, near
from registry import case

import magshell as ms

G = 9.81


def rods(count: int, masses=None, length: float = 1.0, **law):
    """Return links and joints of a chain along x from the origin, with hinges about y."""
    masses = [1.0] * count if masses is None else masses
    links = [
        ms.Link(mass=m, inertia=m * length**2 / 12, center=((k + 0.5) * length, 0, 0))
        for k, m in enumerate(masses)
    ]
    joints = [
        ms.Revolute(links[k], links[k - 1] if k else None, origin=(k * length, 0, 0), axis=(0, 1, 0), **law)
        for k in range(count)
    ]
    return links, joints


def connected(move, joints):
    gap = max(float(move[joint].gap.max()) for joint in joints)
    return holds("joints hold", gap < 1e-12, f"{gap:.1e} m")


def no_gain(move, fraction: float = 2e-2):
    """Check that the energy grows by at most this fraction of the largest kinetic energy."""
    energy, kinetic = move.energy, move.kinetic_energy.max()
    gained = float(energy.max() - energy[0]) / kinetic
    return holds(f"gains at most {fraction:g} of its kinetic energy", gained < fraction, f"{gained:.1e}")


@case("a joint lies on a limit of {:g} N m/rad with 500 times its weight's moment", over=(1e4, 1e8))
def limit_under_load(stiffness):
    """Compare the depth beyond the limit with load over stiffness, counted from the end of the smoothing."""
    links, joints = rods(1, upper_limit=0.3, limit_stiffness=stiffness, limit_smoothing=1e-3, torque=2500.0)
    rest = ms.equilibrium(ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G)))
    angle = float(rest[joints[0]].angle)
    moment = 2500.0 + G * 0.5 * np.cos(angle)
    depth = moment / stiffness + 5e-4 if moment / stiffness > 5e-4 else np.sqrt(2e-3 * moment / stiffness)
    return near("depth beyond the limit", angle - 0.3, depth, rel=1e-6)


@case("a ball joint's spring, from next to half a turn about {}", over=("x", "y", "z"))
def ball_past_poles(axis):
    """Compare a ball joint with a wheel on a spring about any axis, where Euler angles would be singular."""
    turn = np.eye(3)["xyz".index(axis)]
    ball = ms.Link(mass=1.0, inertia=0.02, center=(0, 0, 0))
    rate = np.sqrt(2.0 / 0.02) * 3.1  # amplitude 3.1 rad, just below pi
    socket = ms.Ball(ball, origin=(0, 0, 0), spring_stiffness=2.0, rate=rate * turn)
    period = 2 * np.pi * np.sqrt(0.02 / 2.0)
    move = ms.simulate(ms.Scene(ms.Skeleton([ball], [socket])), steps=800, time_step=period / 800)
    exact = np.abs(3.1 * np.sin(2 * np.pi * move.times / period))
    off = float(np.abs(move[socket].angle - exact).max())
    return both(holds("the angle of the closed form", off < 5e-3, f"{off:.1e} rad off"), no_gain(move, 1e-3))


@case("a chain of fifty links, let go level, whips its end about")
def whip():
    links, joints = rods(50, length=0.02, damping=1e-5)
    move = ms.simulate(
        ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G)), steps=50, time_step=8e-3, record_every=10
    )
    fell = float(move[links[-1]].center[-1, 2])
    return both(connected(move, joints), no_gain(move), holds("its end falls", fell < -0.3, f"{fell:.2f} m"))


@case("a link of {:g} kg hangs on one of 1 kg", over=(1e-6, 1e6))
def masses_apart(mass):
    """Check a light link that swings from a heavy one, and a heavy one that drags a light one along."""
    links, joints = rods(2, masses=(1.0, mass))
    move = ms.simulate(ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G)), steps=200, time_step=2.5e-3)
    answers = [connected(move, joints), no_gain(move)]
    if mass < 1.0:
        alone = rods(1)
        single = ms.simulate(ms.Scene(ms.Skeleton(*alone), gravity=(0, 0, -G)), steps=200, time_step=2.5e-3)
        answers.append(
            near(
                "the heavy one's angle",
                float(move[joints[0]].angle[-1]),
                float(single[alone[1][0]].angle[-1]),
                rel=1e-5,
            )
        )
    return both(*answers)


@case("a torque ten thousand times too strong on a free hinge, for one step of 10 ms")
def far_too_strong():
    """Check a torque of 1e4 N m on 1/3 kg m2: a clear error, or a connected chain after 1.5 rad in a step."""
    links, joints = rods(1, torque=1e4)
    scene = ms.Scene(ms.Skeleton(links, joints))
    try:
        move = ms.simulate(scene, steps=3, time_step=1e-2)
    except ms.NotConverged as error:
        return holds("says what to do", "shorter steps" in str(error), str(error)[:60])
    finite = bool(np.isfinite(move.energy).all())
    return both(connected(move, joints), holds("finite", finite, f"{move.energy[-1]:.3g} J"))


@case("time steps of {:g} s, fifty of them", over=(1e-5, 1e-3, 1e-2, 1e-1))
def time_steps(time_step):
    links, joints = rods(2, damping=0.05)
    move = ms.simulate(
        ms.Scene(ms.Skeleton(links, joints), gravity=(0, 0, -G)), steps=50, time_step=time_step
    )
    return both(connected(move, joints), no_gain(move, 5e-2))
