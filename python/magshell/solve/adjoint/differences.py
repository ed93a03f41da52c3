"""Central differences of high order along one direction."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

# Central differences of eighth and of sixth order, at 1, 2, 3 and 4 steps (1, coefficients of the textbook): exact for
# polynomials up to the eighth degree. Tested by test_first_derivatives_by_values_agree_with_differences.
EIGHTH = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
SIXTH = np.array([3 / 4, -3 / 20, 1 / 60, 0.0])
# Two estimates of a derivative agree if they differ by the first fraction (1) of its largest entry; of those that differ by
# more, the best is taken, up to the second fraction. Tested by test_tangents_agree_with_gradients_in_every_kind.
# Round-off of the function is this fraction (1) of its largest value. Tested by the same.
ROUNDING = 64 * np.finfo(float).eps
_AGREE, _LARGEST_DIFFERENCE = 1e-11, 1e-7


def directional_derivative(
    function: Callable[[float], np.ndarray],
    steps: list[float],
    rounding: float = ROUNDING,
    sizes: np.ndarray | None = None,
) -> np.ndarray | None:
    """Return the derivative of a function of one number at zero, by the first of these steps that suffices; or None.

    Rows of the function's values (k, n) have units of their own. rounding: the error of its values (1), over the largest one
    of the row. sizes: (k,), by which rows become comparable; then round-off of the largest row counts in all of them, except
    where the size is zero.
    """
    return _extrapolated([_Stencil(function, step, rounding, sizes) for step in steps])


def _extrapolated(stencils: list[_Stencil]) -> np.ndarray | None:
    best, smallest, before = None, _LARGEST_DIFFERENCE, np.inf
    for stencil in stencils:
        try:
            linear = stencil.slope(4)
            if stencil.difference(linear, stencil.slope(1)) <= _AGREE:
                return linear
            # Slopes of a cubic at m steps are a + b m^2, as those of forces by the thickness of a sheet.
            growth = (linear - stencil.slope(1)) / 15
            cubic = stencil.slope(1) - growth
            if stencil.difference(cubic + 4 * growth, stencil.slope(2)) <= _AGREE:
                return cubic
            eighth, sixth = stencil.weighted(EIGHTH), stencil.weighted(SIXTH)
        except ValueError:  # beyond the range of the value
            continue
        difference = stencil.difference(eighth, sixth)
        if difference <= _AGREE:
            return eighth
        if difference <= smallest:
            best, smallest = eighth, difference
        if before < _LARGEST_DIFFERENCE and difference > before:  # round-off by now
            break
        before = difference
    return best


class _Stencil:
    """Central differences of a function at multiples of a step."""

    def __init__(
        self,
        function: Callable[[float], np.ndarray],
        step: float,
        rounding: float,
        sizes: np.ndarray | None,
    ):
        self._function, self._step, self._rounding, self._sizes = function, step, rounding, sizes
        self._slopes: dict[int, np.ndarray] = {}
        self._largest: np.ndarray | float = 0.0  # value of the function, for each row

    def slope(self, multiple: int) -> np.ndarray:
        """Return the central difference at a multiple of the step."""
        if multiple not in self._slopes:
            self._slopes[multiple] = self._slope(multiple * self._step)
        return self._slopes[multiple]

    def _slope(self, step: float) -> np.ndarray:
        return (self._value(step) - self._value(-step)) / (2 * step)

    def _value(self, at: float) -> np.ndarray:
        """Return the function, and take note of its size."""
        value = self._function(at)
        self._largest = np.maximum(self._largest, np.abs(value).max(axis=-1, initial=0.0))
        return value

    def weighted(self, order: np.ndarray) -> np.ndarray:
        """Return a difference of high order, with the weights of the changes at 1, 2, 3 and 4 steps."""
        return sum(2 * m * weight * self.slope(m) for m, weight in enumerate(order, 1))

    def difference(self, one: np.ndarray, other: np.ndarray) -> float:
        """Return the largest difference of two estimates relative to the largest entry of its row, beyond round-off.

        It is infinite if an estimate is not finite.
        """
        if not (np.isfinite(one).all() and np.isfinite(other).all()):
            return np.inf
        size, apart = (np.abs(each).max(axis=-1, initial=0.0) for each in (one, one - other))
        apart = apart - self._rounding * self._largest_of_all() / self._step
        return float(np.max(apart / np.where(size > 0.0, size, 1.0), where=apart > 0.0, initial=0.0))

    def _largest_of_all(self) -> np.ndarray | float:
        """Return the largest values of all rows, in the unit of each row; those of the row itself if no other counts."""
        if self._sizes is None:
            return self._largest
        largest = float((self._largest * self._sizes).max(initial=0.0))
        sizes = np.where(self._sizes > 0.0, self._sizes, np.inf)
        return np.maximum(self._largest, largest / sizes)
