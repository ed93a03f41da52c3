"""What is searched for: moduli of bridges, the field that lifts a strip, what robots have to do to reach a target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

if TYPE_CHECKING:
    import torch
    from robots.robot import Robot

    from magshell.envs.environment import Environment

_NOISE = 0.05  # of unknowns in -1 to 1: how far the starts of the seeds are apart


class Task:
    """unknowns: how many, each in -1 to 1. objective(unknowns) -> float; differentiable: the same of a tensor, with a
    gradient, or its square. goal: where a search may end."""

    name: str
    unknowns: int
    goal: float | None = None
    squared: bool = False  # differentiable is: of a distance, which has a kink at its goal
    learned: bool = (
        False  # whether it is an environment too: then with `actions` an episode, `environment` and `lost`
    )
    searches: tuple[str, ...] | None = None  # names of those that are tried; None: all

    def start(self, seed: int) -> np.ndarray:
        """(unknowns,): the same for every method."""
        around = _NOISE * np.random.default_rng([17, seed]).standard_normal(self.unknowns)
        return np.clip(self.middle + around, -1, 1)

    @property
    def middle(self) -> np.ndarray:
        return np.zeros(self.unknowns)


class BridgeTask(Task):
    """[Qiao21] Figure 3: the miss of the mean node, over the sag that is asked for. Needs examples/."""

    goal: float | None = 0.01
    squared: bool = True

    def __init__(self, name: str):
        from _bridges import shape, task

        self.name = name
        self._task = task.Task(getattr(shape, name)())
        self._low, self._high = self._task.bounds
        self.unknowns: int = len(self._low)

    @property
    def middle(self) -> np.ndarray:
        return 2 * (self._task.start - self._low) / (self._high - self._low) - 1

    def objective(self, unknowns: Any) -> float:
        return float(self.differentiable(unknowns)) ** 0.5

    def differentiable(self, unknowns: Any) -> torch.Tensor:
        return self._task.loss(self._moduli(unknowns))

    def _moduli(self, unknowns):
        low, high = self._low, self._high
        if not isinstance(unknowns, np.ndarray):
            low, high = map(unknowns.new_tensor, (low, high))
        return low + 0.5 * (unknowns + 1) * (high - low)


class StripTask(Task):
    """The registered magnetic strip without its disturbance: 50 actions of three numbers. The mean miss of the tip, over
    the strip's length. An episode counts as one simulation."""

    name: str = "strip"
    learned: bool = True

    def __init__(self):
        self._environment = self.environment()
        self.actions: int = self._environment.actions_per_episode
        self.unknowns: int = 3 * self.actions

    @staticmethod
    def environment() -> Environment:
        from magshell.envs.robots import magnetic_strip

        return magnetic_strip(disturbed=False)

    def objective(self, unknowns: Any) -> float:
        self._environment.reset(seed=0)
        rewards = [self._environment.step(action)[1] for action in unknowns.reshape(self.actions, 3)]
        return -sum(rewards) / self.actions

    def lost(self, rewarded: float) -> float:
        """The value of an episode, of all its rewards."""
        return -rewarded / self.actions

    def differentiable(self, unknowns: Any) -> torch.Tensor:
        from magshell.envs.robots import STRIP_LENGTH, STRIP_TARGET

        one = self._environment
        [actuator] = one.actuators
        low, high = (unknowns.new_tensor(each.copy()) for each in (actuator.lower, actuator.upper))
        field = low + 0.5 * (unknowns.reshape(self.actions, 3) + 1) * (high - low)
        each = one.steps_per_action
        motion = ms.simulate(
            one.scene,
            steps=each * self.actions,
            time_step=one.time_step,
            applied_flux_density=field.repeat_interleave(each, dim=0),
            integrator=ms.ImplicitEuler(),
            stiffness_damping=2e-3,
            progress=False,
        )
        tip = np.array(one.scene.mesh.vertices_at(x=STRIP_LENGTH))
        heights = motion.positions[each::each, tip, 2].mean(1)
        return (heights - STRIP_TARGET).abs().mean() / STRIP_LENGTH


class RobotTask(Task):
    """[Qiao21] Figure 4: controls of a robot in every step; how far from the target it ends, over the way there."""

    name: str

    learned: bool = True
    goal: float | None = 0.01
    squared: bool = True
    searches: tuple[str, ...] | None = (
        "L-BFGS",
        "CMA-ES",
    )  # as [Qiao21]'s; some others would need n + 1 motions before they begin

    _FAILED = 2.0  # the miss where a motion fails: as an episode that ends where it began, and is fined

    def __init__(self, name: str, robot: Robot, environment: str):
        self.name, self._robot, self._environment = name, robot, environment
        self.actions: int = robot.steps
        self.unknowns: int = robot.steps * robot.numbers

    @property
    def middle(self) -> np.ndarray:
        return self._robot.first_controls(self._robot.steps).ravel()

    def environment(self) -> Environment:
        from robots import environments

        return getattr(environments, self._environment)(disturbed=False)

    def lost(self, rewarded: float) -> float:
        return 1.0 - rewarded

    def objective(self, unknowns: Any) -> float:
        try:
            return float(self._miss(unknowns))
        except ms.NotConverged:
            return self._FAILED

    def differentiable(self, unknowns: Any) -> torch.Tensor:
        return self._miss(unknowns) ** 2

    def _miss(self, unknowns):
        return self._robot.relative_distance(self._robot.motion(unknowns.reshape(self.actions, -1)))


def robot_task(name: str) -> RobotTask:
    """name: fish, octopus or gripper."""
    from robots.cell_gripper import CellGripper
    from robots.fish import Fish
    from robots.muscle_octopus import MuscleOctopus

    kind, environment = {
        "fish": (Fish, "fish"),
        "octopus": (MuscleOctopus, "muscle_octopus"),
        "gripper": (CellGripper, "cell_gripper"),
    }[name]
    return RobotTask(name, kind(), environment)
