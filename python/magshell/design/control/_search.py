"""Searches for controls, from one start or from random ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import real_numbers
from ..._input.tensors import real_tensor, require_torch
from ...errors import DesignRejected, ObjectiveFailed
from ..minimize import minimize
from ..minimum import MinimizeResult

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


def given_controls(controls):
    """Return the controls (steps, ...) as a copy without graph. Raises ValueError if a number is not finite."""
    torch = require_torch("ms.control")
    now = real_tensor("controls", controls, ("...", "k")).detach().clone()
    if not torch.isfinite(now).all():
        raise ValueError("controls must be finite")
    return now


def row_bound(name: str, value: Any, controls):
    """Return a bound for every entry of the controls, from a number or a row; infinite means no bound."""
    shape, array = tuple(controls.shape[1:]), real_numbers(name, value)
    if np.isnan(array).any():
        raise ValueError(f"{name} must be numbers, got nan")
    if array.shape not in ((), shape):
        raise ValueError(f"{name} must be a number or have the shape of a row, {shape}, got {array.shape}")
    return controls.new_tensor(np.broadcast_to(array, controls.shape).copy())


def check_functions(**functions: Any) -> None:
    """Raise ValueError if one of these arguments is no function."""
    for name, function in functions.items():
        if not callable(function):
            raise ValueError(f"{name} must be a function, got {function!r:.60}")


def search_rows(
    objective: Callable[..., Any],
    rows,
    lower: Numbers,
    upper: Numbers,
    make: Callable[..., Any] | None,
    **options: Any,
) -> tuple[MinimizeResult | None, DesignRejected | None]:
    """Return the best rows, or None, and the error that ended the search early at a design that cannot be evaluated.

    make: function (parameters, lower, upper) -> optimizer; None: ms.optim.LBFGS. options: of ms.minimize.
    """
    rows = rows.clone().requires_grad_()
    try:
        return minimize(objective, [rows], (make or _lbfgs)([rows], lower, upper), **options), None
    except ObjectiveFailed as error:
        if not isinstance(error.__cause__, DesignRejected):
            raise
        return error.last_good, error.__cause__
    except DesignRejected as error:
        return None, error


def _lbfgs(parameters, lower, upper):
    from ..optim import LBFGS

    return LBFGS(parameters, lower=lower, upper=upper, first_step=0.1, max_evaluations=5)


@dataclass(frozen=True)
class Trials:
    """Random controls to begin a search with.

    number: how many. amplitude: (steps, ...), largest deviation of an oscillation from the given control.
    shortest, longest: limits of its period, rows.
    """

    number: int
    amplitude: np.ndarray
    shortest: int
    longest: int

    @classmethod
    def of(cls, number: int, amplitude: Numbers, periods: Numbers, controls) -> Trials:
        """Check the options of the trials. Raises ValueError if there are trials without amplitude or periods."""
        if number == 0:
            return cls(0, np.zeros(controls.shape), 1, 1)
        if amplitude is None or periods is None:
            raise ValueError(f"{number} trials need a trial_amplitude and trial_periods")
        sizes = row_bound("trial_amplitude", amplitude, controls).numpy()
        if not (np.isfinite(sizes).all() and (sizes >= 0).all() and sizes.any()):
            raise ValueError(
                f"trial_amplitude must be finite, not negative and somewhere positive, got {amplitude!r:.60}"
            )
        limits = index_array("trial_periods", periods).tolist()
        if np.shape(limits) != (2,) or not 2 <= limits[0] <= limits[1]:
            raise ValueError(
                f"trial_periods must be two numbers of rows, 2 at least, that rise, got {periods!r:.60}"
            )
        return cls(number, sizes, *limits)

    def drawn(
        self, planned, given: Any, first: int, known: int, end: int, lower: Numbers, upper: Numbers, rng
    ) -> Iterator[Any]:
        """Yield random rows first ... end of the controls.

        Each is as planned until a random row before `known`. From there, every second one repeats what was done one period
        before, if that is known; the others oscillate about the given control. Entries with zero amplitude stay as planned.
        """
        for number in range(self.number):
            begin = int(rng.integers(first, max(known, first + 1)))
            period = round(np.exp(rng.uniform(*np.log([self.shortest, self.longest]))))
            rows, live = planned.clone(), planned.new_tensor(self.amplitude[begin]) > 0
            if number % 2 and period <= begin:
                for row in range(begin, end):
                    rows[row] = rows[row].where(~live, rows[row - period])
            else:
                shape = (1,) * (planned.ndim - 1)
                phases = rng.uniform(0.0, 2 * np.pi) + 2 * np.pi * np.arange(end - begin) / period
                waves = rng.uniform(0.0, 1.0) * np.sin(phases).reshape(-1, *shape) * self.amplitude[begin:end]
                other = given[begin:end] + given.new_tensor(waves)
                rows[begin:end] = rows[begin:end].where(~live, other)
            yield rows[first:end].clamp(lower[first:end], upper[first:end])
