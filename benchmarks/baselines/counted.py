"""An objective that counts how often it is asked for, and stops a search whose budget is spent."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np


class BudgetSpent(Exception):
    """Ends a search from within its objective. Not an error: what was found is in the Counted."""


@dataclass
class Counted:
    """objective: of unknowns (n,) in -1 to 1. goal: a value at which a search may end.

    best: (k,), the lowest value so far, one a simulation; seconds: (k,), of the processor since the first began.
    """

    objective: Callable[[np.ndarray], float]
    budget: int
    goal: float | None = None
    best: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    _began: float | None = None

    def begin(self) -> None:
        """A simulation begins: the clock runs from the first on."""
        if self._began is None:
            self._began = time.process_time()

    def __call__(self, unknowns: np.ndarray) -> float:
        self.begin()
        return self.counted(float(self.objective(np.clip(np.asarray(unknowns, dtype=float), -1.0, 1.0))))

    def counted(self, value: float) -> float:
        """Notes a value that was found in another way, after `begin`. Raises BudgetSpent after the last one."""
        self.begin()
        if not np.isfinite(value):
            raise ValueError(f"the objective must be finite, got {value}")
        self.best.append(min(value, self.best[-1]) if self.best else value)
        self.seconds.append(time.process_time() - self._began)
        if len(self.best) >= self.budget or (self.goal is not None and self.best[-1] <= self.goal):
            raise BudgetSpent
        return value
