"""Robots that come along, registered with gymnasium under magshell/NAME-v0."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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
from .cell_gripper import SPEED, CellGripper
from .environment import Environment
from .fish import TARGET, TETRAHEDRA, TORQUES, Fish
from .library import require_gymnasium
from .muscle_octopus import CELLS, FREQUENCY, NUMBERS, MuscleOctopus
from .robot import Robot
from .steered import Steered

if TYPE_CHECKING:
    from .._checks.kinds import Numbers

__all__ = ["cell_gripper", "fish", "magnetic_strip", "muscle_octopus", "soft_arm"]


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


def fish(
    n_tetrahedra: int = TETRAHEDRA,
    target: Numbers = TARGET,
    render_mode: str | None = None,
    disturbed: bool = True,
) -> Environment:
    """A soft fish with six bones in water; torques in its neck, back, tail and two fins are to take its center of mass to a
    target, (3,) m from where it was. An action lasts 20 ms, an episode 2 s: [Qiao21] Figure 4c. Observed: way and velocity
    of the center of mass, angles and rates of the joints. Rewarded: what an action comes nearer, over the way there.
    n_tetrahedra: about how many. disturbed: whether it starts with a small velocity.

    render_mode: as in Environment.

    >>> import magshell as ms
    >>> ms.envs.robots.fish().action_space.shape
    (5,)
    """
    swimmer = Fish(n_tetrahedra)
    torques = [
        Actuator(joint, "torque", lower=-most, upper=most)
        for joint, most in zip(swimmer.joints, TORQUES, strict=True)
    ]

    def bent(now):
        return [(now[joint].angle, now[joint].rate) for joint in swimmer.joints]

    return _to_target(swimmer, target, torques, bent, render_mode, disturbed)


def muscle_octopus(
    cells: int = CELLS,
    target: Numbers = MuscleOctopus.target,
    render_mode: str | None = None,
    disturbed: bool = True,
) -> Environment:
    """A soft octopus with two muscles in each of eight legs in water, whose center of mass is to go to a target, (3,) m from
    where it was. An action, 64 numbers, four of the wave along each muscle, lasts 5 ms, an episode 2 s: [Qiao21] Figure
    4b. Observed: way and velocity of the center of mass, where the tips of the legs are from it, and the phase of the
    waves. Rewarded and disturbed as the fish. cells: along a leg.

    target: (3,) m. render_mode: as in Environment. disturbed: as of fish.

    >>> import magshell as ms
    >>> ms.envs.robots.muscle_octopus(cells=2).action_space.shape
    (64,)
    """
    swimmer = MuscleOctopus(cells)
    waves = Steered(swimmer.muscles, "activation", NUMBERS * len(swimmer.muscles), _Waves(swimmer))

    def posture(now):
        phase = 2.0 * np.pi * FREQUENCY * now.time
        return [
            *(now.positions[swimmer.tips] - swimmer.weights @ now.positions).ravel(),
            np.sin(phase),
            np.cos(phase),
        ]

    return _to_target(swimmer, target, [waves], posture, render_mode, disturbed)


def cell_gripper(
    target: Numbers = CellGripper.target,
    render_mode: str | None = None,
    disturbed: bool = True,
    **changes: Any,
) -> Environment:
    """Four arms of 56 pneumatic cells under a drone, to grip a ball on a table and to carry it to a target, (3,) m from
    where it was. An action, the volumes of all cells and the speed of the drone, lasts 10 ms, an episode 0.5 s: [Qiao21]
    Figure 4a. Observed: way and velocity of the ball, way of the drone, where the ends of the arms are from the ball.
    Rewarded: what the ball comes nearer, over its way; where a motion fails, the episode ends with -1. Disturbed as the
    fish. changes: of CellGripper's own arguments.

    target: (3,) m. render_mode: as in Environment. disturbed: as of fish.

    >>> import magshell as ms
    >>> ms.envs.robots.cell_gripper().action_space.shape
    (59,)
    """
    gripper = CellGripper(**changes)
    actuators = [
        Steered(gripper.cells, "volume_ratio", len(gripper.cells.groups), _filled),
        Steered(gripper.drone, "displacement", 3, _Speed(SPEED * gripper.time_step)),
    ]

    def grasp(now):
        ends = now[gripper.arms].positions[gripper.ends].mean(axis=1)
        middle = gripper.weights @ now[gripper.ball].positions
        return [*now.action[-3:], *(ends - middle).ravel()]

    return _to_target(gripper, target, actuators, grasp, render_mode, disturbed, failure_reward=-1.0)


class _Waves:
    """Activations of the octopus's muscles, by the four numbers of each one's wave. Can be pickled."""

    def __init__(self, octopus: MuscleOctopus):
        self._octopus = octopus

    def __call__(self, numbers: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
        import torch

        controls = torch.from_numpy(numbers).reshape(1, -1, NUMBERS)
        end = np.array([time + self._octopus.time_step])
        return self._octopus.activations(controls, end)[0].numpy()


class _Speed:
    """Of a support, in m a step."""

    def __init__(self, most: float):
        self._most = most

    def __call__(self, numbers: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
        return before + self._most * numbers


def _filled(numbers: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
    return CellGripper.filled(numbers, before)


def _to_target(
    robot: Robot, target, actuators, further, render_mode, disturbed: bool, **options
) -> Environment:
    """Way and velocity of the traveller's center of mass are observed, and what `further` returns of a Snapshot."""
    goal = np.array(target, dtype=float)
    rest = robot.traveller.mesh.rest_positions

    def way(now):
        return robot.weights @ (now[robot.traveller].positions - rest)

    def away(now):
        return np.linalg.norm(way(now) - goal)

    def seen(now):
        return np.concatenate(
            [way(now), robot.weights @ now[robot.traveller].velocities, np.ravel(further(now))]
        )

    return Environment(
        robot.scene,
        actuators=actuators,
        observation=seen,
        reward=lambda now: (away(now.before) - away(now)) / np.linalg.norm(goal),
        start=(lambda generator: {"velocities": generator.normal(scale=1e-3, size=3)}) if disturbed else None,
        time_step=robot.time_step,
        actions_per_episode=robot.steps,
        simulate={
            "integrator": ImplicitEuler(),
            "solver": robot.solver,
            "stiffness_damping": robot.stiffness_damping,
        },
        render_mode=render_mode,
        **options,
    )


REGISTERED = {
    "magshell/CellGripper-v0": cell_gripper,
    "magshell/Fish-v0": fish,
    "magshell/MagneticStrip-v0": magnetic_strip,
    "magshell/MuscleOctopus-v0": muscle_octopus,
    "magshell/SoftArm-v0": soft_arm,
}

for _id, _make in REGISTERED.items():
    require_gymnasium("envs.robots").register(id=_id, entry_point=f"{__name__}:{_make.__name__}")
