"""The search for the moduli of every tetrahedron by gradient."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

from .task import Task

REACHED = 0.01  # of the sag asked for


@dataclass(frozen=True)
class Found:
    """The result of a search for the moduli.

    unknowns: (2 n_t,), as in Task. errors: distances from the target over the sag asked for, at the start and after
    every iteration; simulations, seconds: until then.
    """

    task: Task
    unknowns: np.ndarray
    errors: np.ndarray
    simulations: np.ndarray
    seconds: np.ndarray

    @property
    def iterations(self) -> int | None:
        """The number of iterations until the error is below 1 % of the sag; None where it was not reached."""
        reached = np.flatnonzero(self.errors < REACHED)
        return int(reached[0]) if len(reached) else None


def found_by_gradient(task: Task, iterations: int = 10) -> Found:
    """Search from uniform moduli by L-BFGS until the error is below 1 % of the sag, for at most `iterations`."""
    low, high = map(torch.tensor, task.bounds)
    x = torch.tensor(task.start, requires_grad=True)
    optimizer = ms.optim.LBFGS([x], lower=low, upper=high)
    task.simulations, began, rows = 0, time.perf_counter(), []

    def objective() -> torch.Tensor:
        loss = task.loss(x)
        if not rows:
            rows.append((float(loss.detach()) ** 0.5, task.simulations, time.perf_counter() - began))
        return loss

    for _ in range(iterations):
        loss = optimizer.step(objective)
        rows.append((float(loss) ** 0.5, task.simulations, time.perf_counter() - began))
        if rows[-1][0] < REACHED:
            break
    errors, simulations, seconds = map(np.array, zip(*rows, strict=True))
    return Found(task, x.detach().numpy().copy(), errors, simulations, seconds)
