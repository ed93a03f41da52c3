"""The search for the controls of every step, by gradient, from several starts."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from robots.robot import Robot

import magshell as ms

REACHED = 0.01  # of the initial distance
EPISODES = 40


@dataclass(frozen=True)
class Found:
    """The result of one search.

    controls: (steps, numbers), from -1 to 1. distances: from the target over the initial distance, for every episode (a
    motion and its gradient); seconds: wall time until each. start: the arguments of its first controls.
    """

    robot: Robot
    start: dict
    controls: np.ndarray
    distances: np.ndarray
    seconds: np.ndarray

    @property
    def episodes(self) -> int | None:
        """The number of episodes until the distance is 1 % of the initial one; None where it was not reached."""
        reached = np.flatnonzero(self.distances < REACHED)
        return int(reached[0]) + 1 if len(reached) else None


def searched(
    robot: Robot,
    steps: int,
    target,
    episodes: int,
    starts: Sequence[dict],
    slope_steps: int,
    difference: float,
) -> dict:
    """Run the searches and measure the first one.

    Returns {"found": the Found of each start (keyword arguments of the robot's first_controls); for the first start
    "motion" with its controls, "forward" and "backward": processor time of a step, ms; "slope": relative error of the
    directional derivative at the start, over `slope_steps` steps; "slope_found": the same at the controls found, over
    all steps}.
    """
    found = [
        found_by_gradient(robot, start, robot.first_controls(steps, **start), target, episodes)
        for start in starts
    ]
    x = torch.tensor(found[0].controls, requires_grad=True)
    began = time.process_time()
    motion = robot.motion(x)
    there = time.process_time()
    (robot.relative_distance(motion, target) ** 2).backward()
    back = time.process_time()
    return {
        "found": found,
        "motion": robot.motion(found[0].controls),
        "forward": 1e3 * (there - began) / steps,
        "backward": 1e3 * (back - there) / steps,
        "slope": slope_error(robot, robot.first_controls(slope_steps, **starts[0]), difference, target),
        "slope_steps": slope_steps,
        "slope_found": slope_error(robot, found[0].controls, difference, target),
    }


def found_by_gradient(
    robot: Robot, start: dict, controls: np.ndarray, target=None, episodes: int = EPISODES
) -> Found:
    """Search by L-BFGS within the bounds, until the distance is 1 % of the initial one, for at most `episodes`."""
    x = torch.tensor(controls, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=-1.0, upper=1.0)
    distances, seconds, began = [], [], time.perf_counter()
    best = (np.inf, controls)

    def objective() -> torch.Tensor:
        nonlocal best
        distance = robot.relative_distance(robot.motion(x), target)
        distances.append(float(distance.detach()))
        seconds.append(time.perf_counter() - began)
        best = min(best, (distances[-1], x.detach().numpy().copy()), key=lambda each: each[0])
        return distance**2

    while len(distances) < episodes and best[0] >= REACHED:
        before = len(distances)
        optimizer.step(objective)
        if len(distances) == before:  # it stands still
            break
    return Found(robot, start, best[1], np.array(distances), np.array(seconds))


def gradient_at(robot: Robot, controls: np.ndarray, target=None) -> np.ndarray:
    """Compute the gradient of the squared distance by all controls, with steps solved to round-off."""
    x = torch.tensor(controls, requires_grad=True)
    return torch.autograd.grad(robot.relative_distance(robot.motion(x, ms.MixedNewton()), target) ** 2, x)[
        0
    ].numpy()


def slope_error(robot: Robot, controls: np.ndarray, step: float, target=None) -> float:
    """Return the relative error of the slope of the squared distance along its gradient against central differences.

    Controls at their bounds stay.
    """
    gradient = np.where(np.abs(controls) <= 1.0 - step, gradient_at(robot, controls, target), 0.0)
    slope = float(np.linalg.norm(gradient))
    there, back = (
        float(robot.relative_distance(robot.motion(moved, ms.MixedNewton()), target)) ** 2
        for moved in (controls + sign * step * gradient / slope for sign in (1, -1))
    )
    return abs((there - back) / (2 * step) - slope) / slope
