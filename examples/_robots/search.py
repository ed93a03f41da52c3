"""The search for the controls of every step, by gradient, from several starts."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from robots.robot import Robot

import magshell as ms

REACHED = 0.01  # of the way asked for
EPISODES = 40


@dataclass(frozen=True)
class Found:
    """controls: (steps, numbers), from -1 to 1. misses: of every episode, a motion and its gradient, the distance from the
    target over the way there; seconds: on the wall, until each. start: what its first controls were made of."""

    robot: Robot
    start: dict
    controls: np.ndarray
    misses: np.ndarray
    seconds: np.ndarray

    @property
    def episodes(self) -> int | None:
        """Until 1 % of the way; None where it was not reached."""
        reached = np.flatnonzero(self.misses < REACHED)
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
    """{"found": Found of each start, arguments of the robot's first_controls; of the first one "motion" with its
    controls, and "forward", "backward": ms of the processor, a step; "slope": error at the start, over so many steps;
    "slope_found": at the controls found, over all steps}."""
    found = [
        found_by_gradient(robot, start, robot.first_controls(steps, **start), target, episodes)
        for start in starts
    ]
    x = torch.tensor(found[0].controls, requires_grad=True)
    began = time.process_time()
    motion = robot.motion(x)
    there = time.process_time()
    (robot.miss(motion, target) ** 2).backward()
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
    """L-BFGS between the bounds, until 1 % of the way or so many episodes."""
    x = torch.tensor(controls, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=-1.0, upper=1.0)
    misses, seconds, began = [], [], time.perf_counter()
    best = (np.inf, controls)

    def objective() -> torch.Tensor:
        nonlocal best
        miss = robot.miss(robot.motion(x), target)
        misses.append(float(miss.detach()))
        seconds.append(time.perf_counter() - began)
        best = min(best, (misses[-1], x.detach().numpy().copy()), key=lambda each: each[0])
        return miss**2

    while len(misses) < episodes and best[0] >= REACHED:
        before = len(misses)
        optimizer.step(objective)
        if len(misses) == before:  # it stands still
            break
    return Found(robot, start, best[1], np.array(misses), np.array(seconds))


def gradient_at(robot: Robot, controls: np.ndarray, target=None) -> np.ndarray:
    """Of the squared miss by all controls, of steps solved to round-off."""
    x = torch.tensor(controls, requires_grad=True)
    return torch.autograd.grad(robot.miss(robot.motion(x, ms.MixedNewton()), target) ** 2, x)[0].numpy()


def slope_error(robot: Robot, controls: np.ndarray, step: float, target=None) -> float:
    """Of the squared miss by all controls: slope along its gradient against central differences. Controls at their bounds
    stay."""
    gradient = np.where(np.abs(controls) <= 1.0 - step, gradient_at(robot, controls, target), 0.0)
    slope = float(np.linalg.norm(gradient))
    there, back = (
        float(robot.miss(robot.motion(moved, ms.MixedNewton()), target)) ** 2
        for moved in (controls + sign * step * gradient / slope for sign in (1, -1))
    )
    return abs((there - back) / (2 * step) - slope) / slope
