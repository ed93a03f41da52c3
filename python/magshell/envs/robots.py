"""Two small robots as environments, registered with gymnasium under magshell/NAME-v0."""

from __future__ import annotations

import numpy as np

from ..mesh import generate as meshes
from ..model.fields.field import UniformField
from ..model.rigid.joints import Revolute
from ..model.rigid.link import Link
from ..model.rigid.skeleton import Skeleton
from ..model.scene.scene import Scene
from ..model.shells.shell import Shell
from ..model.solids.materials import NeoHookean
from ..model.solids.solid import Solid
from ..model.supports.supports import Clamp, Pin
from ..solve.options import ImplicitEuler
from .action import Action
from .environment import Environment
from .library import require_gymnasium

__all__ = ["magnetic_strip", "soft_arm"]


STRIP_LENGTH, STRIP_TARGET = 0.05, 0.01  # m


def magnetic_strip(
    target: float = STRIP_TARGET, render_mode: str | None = None, disturbed: bool = True
) -> Environment:
    """Make the environment of a magnetized strip, 5 cm long and clamped at one end, whose tip a field lifts to a
    height.

    The field is at most 4 mT upwards and 1 mT along and across. An action lasts 20 ms, an episode 1 s. Observed:
    heights and speeds of the tip and of the middle, over the strip's length.

    target: m, the height. render_mode: as in Environment. disturbed: whether it starts with a small velocity.

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
        return [each / STRIP_LENGTH for each in (*heights, *speeds)]

    return Environment(
        scene,
        actuators=[
            Action(scene, "applied_flux_density", lower=(-1e-3, -1e-3, -4e-3), upper=(1e-3, 1e-3, 4e-3))
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
    """Make the environment of a soft bar, 40 cm long and held at one end, that a torque in its hinge bends to an
    angle.

    Inside the bar are two bones with the hinge between them. The torque is at most 10 N m. An action lasts 20 ms,
    an episode 1 s. Observed: angle and rate of the hinge.

    target: rad, the angle. render_mode: as in Environment.

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
        actuators=[Action(hinge, "torque", lower=-10.0, upper=10.0)],
        observation=lambda now: [float(now[hinge].angle), float(now[hinge].rate)],
        reward=lambda now: -abs(float(now[hinge].angle) - target),
        start=lambda generator: {"velocities": generator.normal(scale=0.01, size=3)},
        time_step=1e-2,
        steps_per_action=2,
        actions_per_episode=50,
        simulate={"integrator": ImplicitEuler(), "stiffness_damping": 2e-3},
        render_mode=render_mode,
    )


REGISTERED = {
    "magshell/MagneticStrip-v0": magnetic_strip,
    "magshell/SoftArm-v0": soft_arm,
}


for _id, _make in REGISTERED.items():
    require_gymnasium("envs.robots").register(id=_id, entry_point=f"{__name__}:{_make.__name__}")
