"""Robots that come along, registered with gymnasium under magshell/NAME-v0."""

from __future__ import annotations

import numpy as np

from .. import meshes
from ..bodies.joints import Revolute
from ..bodies.link import Link
from ..bodies.materials import NeoHookean
from ..bodies.shell import Shell
from ..bodies.skeleton import Skeleton
from ..bodies.solid import Solid
from ..fields.field import UniformField
from ..methods.integrators import ImplicitEuler
from ..scene.scene import Scene
from ..surroundings.supports import Clamp, Pin
from .actuator import Actuator
from .environment import Environment
from .fish import SOLVER, STEPS, TARGET, TETRAHEDRA, TIME_STEP, TORQUES, Fish
from .library import require_gymnasium

__all__ = ["fish", "magnetic_strip", "soft_arm"]


STRIP_LENGTH, STRIP_TARGET = 0.05, 0.01  # m


def magnetic_strip(
    target: float = STRIP_TARGET, render_mode: str | None = None, disturbed: bool = True
) -> Environment:
    """A magnetized strip, 5 cm long and clamped at one end; a field of up to 4 mT upwards and 1 mT along and across is
    to lift its tip to a height, m. An action lasts 20 ms, an episode 1 s. Observed: heights and speeds of the tip and of
    the middle, over its length. disturbed: whether it starts with a small velocity.

    target: m, the height. render_mode: as in Environment.

    >>> import magshell as ms
    >>> ms.envs.robots.magnetic_strip().action_space.shape
    (3,)
    """
    mesh = meshes.rectangle(STRIP_LENGTH, 0.01, cells=(8, 2))
    sheet = Shell(
        mesh, thickness=1e-3, young_modulus=3e6, mass_density=1e3, remanent_magnetization=(4e4, 0.0, 0.0)
    )
    scene = Scene(sheet, supports=[Clamp(mesh.edges_at(x=0.0))], field=UniformField(), gravity=(0, 0, -9.81))
    tip, middle = mesh.vertices_at(x=STRIP_LENGTH), mesh.vertices_at(x=STRIP_LENGTH / 2)

    def seen(now):
        heights = (now.positions[tip, 2].mean(), now.positions[middle, 2].mean())
        speeds = (now.velocities[tip, 2].mean(), now.velocities[middle, 2].mean())
        return np.array([*heights, *speeds]) / STRIP_LENGTH

    return Environment(
        scene,
        actuators=[
            Actuator(scene, "applied_flux_density", lower=(-1e-3, -1e-3, -4e-3), upper=(1e-3, 1e-3, 4e-3))
        ],
        observation=seen,
        reward=lambda now: -abs(now.positions[tip, 2].mean() - target) / STRIP_LENGTH,
        start=(lambda generator: {"velocities": generator.normal(scale=0.01, size=3)}) if disturbed else None,
        time_step=1e-2,
        steps_per_action=2,
        actions_per_episode=50,
        simulate={"integrator": ImplicitEuler(), "stiffness_damping": 2e-3},
        render_mode=render_mode,
    )


def soft_arm(target: float = 0.6, render_mode: str | None = None) -> Environment:
    """A soft bar, 40 cm long and held at one end, with two bones and the hinge between them inside; a torque up to 10 N m is
    to bend it to an angle, rad. An action lasts 20 ms, an episode 1 s. Observed: angle and rate of the hinge.

    target, render_mode: as in magnetic_strip.

    >>> import magshell as ms
    >>> ms.envs.robots.soft_arm().action_space.shape
    (1,)
    """
    mesh = meshes.box((0.4, 0.06, 0.06), cells=(8, 4, 4))
    flesh = Solid(
        mesh, material=NeoHookean(young_modulus=5e5, poisson_ratio=0.4), mass_density=500.0, element="linear"
    )
    x, y, z = flesh.mesh.rest_positions.T
    inside = (np.abs(y - 0.03) < 0.02) & (np.abs(z - 0.03) < 0.02)
    upper = Link(np.flatnonzero(inside & (x > 0.02) & (x < 0.17)), body=flesh)
    lower = Link(np.flatnonzero(inside & (x > 0.22)), body=flesh)
    hinge = Revolute(lower, upper, origin=(0.2, 0.03, 0.03), axis=(0.0, 1.0, 0.0), torque=0.0)
    held = Pin(np.flatnonzero(x < 1e-9))
    scene = Scene([flesh, Skeleton([upper, lower], [hinge])], supports=[held], gravity=(0, 0, -9.81))
    return Environment(
        scene,
        actuators=[Actuator(hinge, "torque", lower=-10.0, upper=10.0)],
        observation=lambda now: [float(now[hinge].angle), float(now[hinge].rate)],
        reward=lambda now: -abs(float(now[hinge].angle) - target),
        start=lambda generator: {"velocities": generator.normal(scale=0.01, size=3)},
        time_step=1e-2,
        steps_per_action=2,
        actions_per_episode=50,
        simulate={"integrator": ImplicitEuler(), "stiffness_damping": 2e-3},
        render_mode=render_mode,
    )


def fish(n_tetrahedra: int = TETRAHEDRA, target=TARGET, render_mode: str | None = None) -> Environment:
    """A soft fish with six bones in water; torques in its neck, back, tail and two fins are to take its center of mass to a
    target, (3,) m from where it was. An action lasts 20 ms, an episode 2 s: [Qiao21] Figure 4c. Observed: way and velocity
    of the center of mass, angles and rates of the joints. Rewarded: what an action comes nearer, over the way there.
    n_tetrahedra: about how many.

    render_mode: as in Environment.

    >>> import magshell as ms
    >>> ms.envs.robots.fish().action_space.shape
    (5,)
    """
    swimmer = Fish(n_tetrahedra)
    goal = np.array(target, dtype=float)
    rest = swimmer.flesh.mesh.rest_positions

    def away(now):
        return np.linalg.norm(swimmer.weights @ (now.positions - rest) - goal)

    def seen(now):
        way, velocity = (swimmer.weights @ each for each in (now.positions - rest, now.velocities))
        turned = [(now[joint].angle, now[joint].rate) for joint in swimmer.joints]
        return np.concatenate([way, velocity, np.ravel(turned)])

    return Environment(
        swimmer.scene,
        actuators=[
            Actuator(joint, "torque", lower=-most, upper=most)
            for joint, most in zip(swimmer.joints, TORQUES, strict=True)
        ],
        observation=seen,
        reward=lambda now: (away(now.before) - away(now)) / np.linalg.norm(goal),
        start=lambda generator: {"velocities": generator.normal(scale=1e-3, size=3)},
        time_step=TIME_STEP,
        actions_per_episode=STEPS,
        simulate={"integrator": ImplicitEuler(), "solver": SOLVER},
        render_mode=render_mode,
    )


REGISTERED = {
    "magshell/Fish-v0": fish,
    "magshell/MagneticStrip-v0": magnetic_strip,
    "magshell/SoftArm-v0": soft_arm,
}

for _id, _make in REGISTERED.items():
    require_gymnasium("envs.robots").register(id=_id, entry_point=f"{__name__}:{_make.__name__}")
