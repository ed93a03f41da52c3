"""The robots of [Qiao21] as environments, registered with gymnasium under magshell/NAME-v0 once this is imported."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from magshell.envs.action import Action
from magshell.envs.environment import Environment, require_gymnasium
from magshell.envs.parametric_action import ParametricAction
from magshell.solve.options import ImplicitEuler
from robots.cell_gripper import SPEED, CellGripper
from robots.fish import TARGET, TETRAHEDRA, TORQUES, Fish
from robots.muscle_octopus import CELLS, FREQUENCY, NUMBERS, MuscleOctopus
from robots.robot import Robot

if TYPE_CHECKING:
    from magshell._input.kinds import Numbers


__all__ = ["cell_gripper", "fish", "muscle_octopus"]


def fish(
    n_tetrahedra: int = TETRAHEDRA,
    target: Numbers = TARGET,
    render_mode: str | None = None,
    disturbed: bool = True,
) -> Environment:
    """Build the environment of a soft fish with six bones in water, [Qiao21] Figure 4c.

    Torques in its neck, back, tail and two fins are to take its center of mass to a target, (3,) m from its start. An
    action lasts 20 ms, an episode 2 s. Observed: displacement and velocity of the center of mass, angles and rates of
    the joints. Reward: the decrease of the distance to the target in an action, over the initial distance.
    n_tetrahedra: about how many. disturbed: whether it starts with a small velocity.

    render_mode: as in Environment.

    >>> from robots.environments import fish
    >>> fish().action_space.shape
    (5,)
    """
    swimmer = Fish(n_tetrahedra)
    torques = [
        Action(joint, "torque", lower=-most, upper=most)
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
    """Build the environment of a soft octopus with two muscles in each of eight legs in water, [Qiao21] Figure 4b.

    Its center of mass is to go to a target, (3,) m from its start. An action has 64 numbers, four of the wave along
    each muscle, and lasts 5 ms, an episode 2 s. Observed: displacement and velocity of the center of mass, the tips of
    the legs relative to it, and the phase of the waves. Reward and disturbance are those of the fish. cells: along a
    leg.

    target: (3,) m. render_mode: as in Environment. disturbed: as of fish.

    >>> from robots.environments import muscle_octopus
    >>> muscle_octopus(cells=2).action_space.shape
    (64,)
    """
    swimmer = MuscleOctopus(cells)
    waves = ParametricAction(swimmer.muscles, "activation", NUMBERS * len(swimmer.muscles), _Waves(swimmer))

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
    """Build the environment of four arms of 56 pneumatic cells under a drone, [Qiao21] Figure 4a.

    They are to grip a ball on a table and to carry it to a target, (3,) m from its start. An action, the volumes of
    all cells and the speed of the drone, lasts 10 ms, an episode 0.5 s. Observed: displacement and velocity of the
    ball, displacement of the drone, the ends of the arms relative to the ball. Reward: the decrease of the ball's
    distance to the target, over the initial one; where a motion fails, the episode ends with -1. Disturbance as of the
    fish. changes: keyword arguments of CellGripper.

    target: (3,) m. render_mode: as in Environment. disturbed: as of fish.

    >>> from robots.environments import cell_gripper
    >>> cell_gripper().action_space.shape
    (59,)
    """
    gripper = CellGripper(**changes)
    actuators = [
        ParametricAction(gripper.cells, "volume_ratio", len(gripper.cells.groups), _filled),
        ParametricAction(gripper.drone, "displacement", 3, _Speed(SPEED * gripper.time_step)),
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
    """The action that moves a support, by at most `most` [m] a step."""

    def __init__(self, most: float):
        self._most = most

    def __call__(self, numbers: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
        return before + self._most * numbers


def _filled(numbers: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
    return CellGripper.filled(numbers, before)


def _to_target(
    robot: Robot, target, actuators, further, render_mode, disturbed: bool, **options
) -> Environment:
    """Build the environment of a robot that goes to a target.

    Displacement and velocity of the traveller's center of mass are observed, and the values that `further` returns for
    a Snapshot.
    """
    goal = np.array(target, dtype=float)
    rest = robot.traveller.mesh.rest_positions

    def displacement(now):
        return robot.weights @ (now[robot.traveller].positions - rest)

    def away(now):
        return np.linalg.norm(displacement(now) - goal)

    def seen(now):
        return np.concatenate(
            [displacement(now), robot.weights @ now[robot.traveller].velocities, np.ravel(further(now))]
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
    "magshell/MuscleOctopus-v0": muscle_octopus,
}


for _id, _make in REGISTERED.items():
    require_gymnasium("robots.environments").register(id=_id, entry_point=f"{__name__}:{_make.__name__}")
