"""Controls to try before a search: oscillations drawn at random, and what was done before once more."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._checks.arrays import index_array
from ._search import row_bound

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


@dataclass(frozen=True)
class Trials:
    """number: of each part. spread: (steps, ...), how far from the control given an oscillation goes. shortest, longest:
    rows of a period."""

    number: int
    spread: np.ndarray
    shortest: int
    longest: int

    @classmethod
    def of(cls, number: int, spread: Numbers, periods: Numbers, controls) -> Trials:
        """Raises ValueError where something is to be tried and it is not said how."""
        if number == 0:
            return cls(0, np.zeros(controls.shape), 1, 1)
        if spread is None or periods is None:
            raise ValueError(f"{number} trials need a spread and periods")
        sizes = row_bound("spread", spread, controls).numpy()
        if not (np.isfinite(sizes).all() and (sizes >= 0).all() and sizes.any()):
            raise ValueError(
                f"spread must be finite, not negative and somewhere positive, got {spread!r:.60}"
            )
        limits = index_array("periods", periods).tolist()
        if np.shape(limits) != (2,) or not 2 <= limits[0] <= limits[1]:
            raise ValueError(
                f"periods must be two numbers of rows, 2 at least, that rise, got {periods!r:.60}"
            )
        return cls(number, sizes, *limits)

    def drawn(
        self, planned, given: Any, first: int, known: int, end: int, lower: Numbers, upper: Numbers, rng
    ) -> Iterator[Any]:
        """Rows first ... end, each as planned until a random row before `known`, and then something else, every other one
        of them a repetition if enough is known; entries without a spread stay as planned."""
        for number in range(self.number):
            begin = int(rng.integers(first, max(known, first + 1)))
            period = round(np.exp(rng.uniform(*np.log([self.shortest, self.longest]))))
            rows, live = planned.clone(), planned.new_tensor(self.spread[begin]) > 0
            if number % 2 and period <= begin:
                for row in range(begin, end):
                    rows[row] = rows[row].where(~live, rows[row - period])
            else:
                shape = (1,) * (planned.ndim - 1)
                phases = rng.uniform(0.0, 2 * np.pi) + 2 * np.pi * np.arange(end - begin) / period
                waves = rng.uniform(0.0, 1.0) * np.sin(phases).reshape(-1, *shape) * self.spread[begin:end]
                other = given[begin:end] + given.new_tensor(waves)
                rows[begin:end] = rows[begin:end].where(~live, other)
            yield rows[first:end].clamp(lower[first:end], upper[first:end])
