"""Objective that counts its evaluations, and stops a search when the budget is spent."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


class BudgetSpent(Exception):
    """An exception that ends a search from within its objective. It is no error: the result is in the Counted."""


@dataclass
class Counted:
    """An objective with a count of its evaluations.

    objective: function of the variables (n,) in -1 to 1. budget: largest number of evaluations. goal: a value at
    which a search may end. best: (k,), the lowest value after each simulation; seconds: (k,), processor time since
    the first one began.
    """

    objective: Callable[[np.ndarray], float]
    budget: int
    goal: float | None = None
    best: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    _began: float | None = None

    def begin(self) -> None:
        """Start the clock with the first simulation."""
        if self._began is None:
            self._began = time.process_time()

    def __call__(self, unknowns: np.ndarray) -> float:
        self.begin()
        return self.counted(float(self.objective(np.clip(np.asarray(unknowns, dtype=float), -1.0, 1.0))))

    def counted(self, value: float) -> float:
        """Record a value that was computed elsewhere, after `begin`. Raises BudgetSpent after the last one."""
        self.begin()
        if not np.isfinite(value):
            raise ValueError(f"the objective must be finite, got {value}")
        self.best.append(min(value, self.best[-1]) if self.best else value)
        self.seconds.append(time.process_time() - self._began)
        if len(self.best) >= self.budget or (self.goal is not None and self.best[-1] <= self.goal):
            raise BudgetSpent
        return value
