"""Small robots as environments, registered with gymnasium under magshell/NAME-v0."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..mesh import generate as meshes
from ..model.contact.contact import Contact
from ..model.contact.obstacles.plane import Plane
from ..model.fields.field import UniformField
from ..model.loads.water import Water
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
from .environment import Environment, require_gymnasium
from .parametric_action import ParametricAction

if TYPE_CHECKING:
    from collections.abc import Callable

    from .snapshot import Snapshot

__all__ = ["magnetic_strip", "rolling_strip", "soft_arm", "swimmer"]


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


ROLLER_LENGTH, SWIMMER_LENGTH = 0.02, 0.02  # m


def rolling_strip(render_mode: str | None = None, disturbed: bool = True) -> Environment:
    """Make the environment of a magnetized strip, 2 cm long, that a field bends into a wheel and rolls over the ground.

    Its magnetization turns once along its length, as that of [Hu18]'s robot. The field is at most 10 mT along (x) and
    upwards (z). An action lasts 20 ms, an episode 1 s. Observed: the vectors from the middle to both ends, over the
    length, the velocity of its middle, in lengths a second, and the field, over 10 mT; each by x and z. The reward is the
    way along x during the action, in lengths.

    render_mode: as in Environment. disturbed: whether it starts with a small velocity.

    A field that turns four times a second rolls it by more than a length a turn:

    >>> import magshell as ms, numpy as np
    >>> robot = ms.envs.robots.rolling_strip()
    >>> _ = robot.reset(seed=0)
    >>> angles = 2 * np.pi * 4.0 * 0.02 * np.arange(1, 51)
    >>> way = sum(robot.step((np.cos(angle), -np.sin(angle)))[1] for angle in angles)
    >>> bool(way > 2.0)
    True
    """
    length, thickness, strongest = ROLLER_LENGTH, 4e-4, 1e-2
    mesh = meshes.rectangle(length, 5e-3, cells=(16, 2)).transformed(translation=(0, 0, 0.75 * thickness))
    turn = 2.0 * np.pi * mesh.face_barycenters[:, 0] / length
    sheet = Shell(
        mesh,
        thickness=thickness,
        young_modulus=5e5,
        mass_density=2e3,
        remanent_magnetization=4e4 * np.stack([np.cos(turn), 0.0 * turn, np.sin(turn)], axis=1),
    )
    floor = Contact(Plane(), friction_coefficient=0.6, offset=0.5 * thickness)
    scene = Scene(
        sheet, contacts=[floor], field=UniformField(), gravity=(0, 0, -9.81), allow_rigid_motions=True
    )
    return _moving_strip(scene, length, strongest, 4e-3, 5, _forward, render_mode, disturbed)


def swimmer(render_mode: str | None = None, disturbed: bool = True) -> Environment:
    """Make the environment of a strip with a magnetized head, 2 cm long, that a field wags through water.

    The head is the first 3 tenths, magnetized towards its front, along -x; the tail is passive and bends. The field is at
    most 8 mT along (x) and across (z). An action lasts 20 ms, an episode 1 s. Observed: as for rolling_strip. The reward
    is the way along -x during the action, in lengths.

    render_mode: as in Environment. disturbed: whether it starts with a small velocity.

    A field that swings five times a second drives it ahead:

    >>> import magshell as ms, numpy as np
    >>> robot = ms.envs.robots.swimmer()
    >>> _ = robot.reset(seed=0)
    >>> swings = np.sin(2 * np.pi * 5.0 * 0.02 * np.arange(1, 51))
    >>> way = sum(robot.step((-0.5, swing))[1] for swing in swings)
    >>> bool(way > 0.05)
    True
    """
    length, strongest = SWIMMER_LENGTH, 8e-3
    mesh = meshes.rectangle(length, 5e-3, cells=(12, 2))
    in_head = mesh.face_barycenters[:, 0] < 0.3 * length
    sheet = Shell(
        mesh,
        thickness=2e-4,
        young_modulus=2e5,
        mass_density=1.5e3,
        remanent_magnetization=-4e4 * in_head[:, None] * np.array([1.0, 0.0, 0.0]),
    )
    water = Water(drag_coefficient=1.0, thrust_coefficient=0.0)  # 2 sin^2 along the flow
    scene = Scene(sheet, water=water, field=UniformField(), allow_rigid_motions=True)
    return _moving_strip(scene, length, strongest, 5e-3, 4, _ahead, render_mode, disturbed)


def _forward(now) -> object:
    """Return the way of the middle of all vertices along x during an action, m."""
    return now.positions[:, 0].mean() - now.before.positions[:, 0].mean()


def _ahead(now) -> object:
    return -_forward(now)


def _moving_strip(
    scene: Scene,
    length: float,
    strongest: float,
    time_step: float,
    steps_per_action: int,
    distance: Callable[[Snapshot], object],
    render_mode: str | None,
    disturbed: bool,
) -> Environment:
    """Make the environment of a strip along x that a field in the plane of x and z moves.

    strongest: T, of each component of the field. distance: function of a snapshot: the distance travelled that the reward
        counts, m.
    """
    x = scene.mesh.rest_positions[:, 0]
    ends = [np.flatnonzero(x < 1e-3 * length), np.flatnonzero(x > 0.999 * length)]
    field = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) * strongest

    def seen(now):
        middle, speed = now.positions.mean(0), now.velocities.mean(0) / length
        arms = [(now.positions[end].mean(0) - middle) / length for end in ends]
        return [vector[axis] for vector in (*arms, speed, now.action / strongest) for axis in (0, 2)]

    return Environment(
        scene,
        actuators=[
            ParametricAction(
                scene,
                "applied_flux_density",
                2,
                lambda numbers, time, before: numbers @ _like(field, numbers),
            )
        ],
        observation=seen,
        reward=lambda now: distance(now) / length,
        start=(lambda generator: {"velocities": generator.normal(scale=1e-3, size=3)}) if disturbed else None,
        time_step=time_step,
        steps_per_action=steps_per_action,
        actions_per_episode=50,
        simulate={"integrator": ImplicitEuler(), "stiffness_damping": 2e-3},
        render_mode=render_mode,
    )


def _like(array: np.ndarray, other: Any) -> Any:
    """Return an array as a tensor, if the other one is."""
    return array if isinstance(other, np.ndarray) else other.new_tensor(array)


REGISTERED = {
    "magshell/MagneticStrip-v0": magnetic_strip,
    "magshell/RollingStrip-v0": rolling_strip,
    "magshell/SoftArm-v0": soft_arm,
    "magshell/Swimmer-v0": swimmer,
}


for _id, _make in REGISTERED.items():
    require_gymnasium("envs.robots").register(id=_id, entry_point=f"{__name__}:{_make.__name__}")
