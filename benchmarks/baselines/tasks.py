"""Tasks of the searches: moduli of bridges, the field that lifts a strip, controls with which robots reach a target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import magshell as ms

if TYPE_CHECKING:
    import torch
    from robots.robot import Robot

    from magshell.envs.environment import Environment

_NOISE = 0.05  # standard deviation of the starts of different seeds, for variables in -1 to 1


class Task:
    """A minimization for all searches.

    unknowns: number of variables, each in -1 to 1. objective(unknowns) -> float; differentiable: the same function
    of a tensor, with a gradient, or its square. goal: a value at which a search may end.
    """

    name: str
    unknowns: int
    goal: float | None = None
    squared: bool = False  # whether differentiable returns the square: a distance has a kink at its goal
    learned: bool = False  # whether there is an environment too: then with `actions` per episode, `environment` and `lost`
    searches: tuple[str, ...] | None = None  # names of the searches that are tried; None: all

    def start(self, seed: int) -> np.ndarray:
        """Return the start of a seed, (unknowns,), the same for every method."""
        around = _NOISE * np.random.default_rng([17, seed]).standard_normal(self.unknowns)
        return np.clip(self.middle + around, -1, 1)

    @property
    def middle(self) -> np.ndarray:
        return np.zeros(self.unknowns)


class BridgeTask(Task):
    """The task of [Qiao21] Figure 3: the error of the mean node, over the desired sag. Needs examples/."""

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
    """The task of the registered magnetic strip without its disturbance: 50 actions of three numbers.

    The objective is the mean error of the tip's height, over the strip's length. An episode counts as one
    simulation.
    """

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
        """Return the objective of an episode from the sum of its rewards."""
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
    """The task of [Qiao21] Figure 4: controls of a robot in every step.

    The objective is the distance from the target at the end, over that at the start.
    """

    name: str

    learned: bool = True
    goal: float | None = 0.01
    squared: bool = True
    searches: tuple[str, ...] | None = (
        "L-BFGS",
        "CMA-ES",
    )  # those of [Qiao21]; some others need n + 1 motions before they begin

    _FAILED = (
        2.0  # relative distance if a motion fails: that of an episode that ends at its start, plus a penalty
    )

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
            return float(self._relative_distance(unknowns))
        except ms.NotConverged:
            return self._FAILED

    def differentiable(self, unknowns: Any) -> torch.Tensor:
        return self._relative_distance(unknowns) ** 2

    def _relative_distance(self, unknowns):
        """Return the relative distance from the target at the end of the motion."""
        return self._robot.relative_distance(self._robot.motion(unknowns.reshape(self.actions, -1)))


def robot_task(name: str) -> RobotTask:
    """Return the task of a robot. name: fish, octopus or gripper."""
    from robots.cell_gripper import CellGripper
    from robots.fish import Fish
    from robots.muscle_octopus import MuscleOctopus

    kind, environment = {
        "fish": (Fish, "fish"),
        "octopus": (MuscleOctopus, "muscle_octopus"),
        "gripper": (CellGripper, "cell_gripper"),
    }[name]
    return RobotTask(name, kind(), environment)
