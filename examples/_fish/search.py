"""The search for the torques of every step, by gradient."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms
from magshell.envs.fish import TARGET, TIME_STEP, Fish

REACHED = 0.01  # of the way asked for
EPISODES = 40


def first_torques(steps: int, amplitude: float = 0.5, frequency: float = 2.0) -> np.ndarray:
    """(steps, 5), over the largest: a wave of so many Hz along the spine, fins at rest. Without any motion the gradient
    would be zero: water pushes with the square of the speed."""
    phase = 2 * np.pi * frequency * TIME_STEP * np.arange(steps)
    spine = amplitude * np.sin(phase[:, None] - np.arange(3))
    return np.concatenate([spine, np.zeros((steps, 2))], axis=1)


@dataclass(frozen=True)
class Found:
    """controls: (steps, 5), over the largest torques. misses: of every episode, a motion and its gradient, the distance
    from the target over the way there; seconds: on the wall, until each."""

    fish: Fish
    controls: np.ndarray
    misses: np.ndarray
    seconds: np.ndarray

    @property
    def episodes(self) -> int | None:
        """Until 1 % of the way; None where it was not reached."""
        reached = np.flatnonzero(self.misses < REACHED)
        return int(reached[0]) + 1 if len(reached) else None


def found_by_gradient(fish: Fish, start: np.ndarray, target=TARGET, episodes: int = EPISODES) -> Found:
    """L-BFGS between the largest torques, until 1 % of the way or so many episodes."""
    x = torch.tensor(start, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=-1.0, upper=1.0)
    misses, seconds, began = [], [], time.perf_counter()
    best = (np.inf, start)

    def objective() -> torch.Tensor:
        nonlocal best
        miss = fish.miss(fish.motion(x), target)
        misses.append(float(miss.detach()))
        seconds.append(time.perf_counter() - began)
        best = min(best, (misses[-1], x.detach().numpy().copy()), key=lambda each: each[0])
        return miss**2

    while len(misses) < episodes and best[0] >= REACHED:
        before = len(misses)
        optimizer.step(objective)
        if len(misses) == before:  # it stands still
            break
    return Found(fish, best[1], np.array(misses), np.array(seconds))


def slope_error(fish: Fish, controls: np.ndarray, step: float) -> float:
    """Of the squared miss by all torques: the slope along its gradient against central differences."""
    x = torch.tensor(controls, requires_grad=True)
    (gradient,) = torch.autograd.grad(fish.miss(fish.motion(x, ms.MixedNewton())) ** 2, x)
    slope = float(gradient.norm())
    direction = (gradient / slope).numpy()
    there, back = (
        float(fish.miss(fish.motion(controls + sign * step * direction, ms.MixedNewton()))) ** 2
        for sign in (1, -1)
    )
    return abs((there - back) / (2 * step) - slope) / slope
