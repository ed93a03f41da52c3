"""Random starting points in a box."""

from __future__ import annotations

import math
import numbers
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import real_numbers
from ..._input.tensors import detached

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


# scipy's table of Sobol directions ends here. In so many dimensions, low-discrepancy points have no advantage anyway.
_LONGEST_SOBOL = 21201


def random_starts(count: int, lower: Numbers, upper: Numbers, seed: int = 0) -> np.ndarray:
    """Return starting points that fill a box evenly, (count, ...): the rest of the shape is that of the bounds.

    lower, upper: numbers or arrays that fit each other. seed: the same seed gives the same starts, and a larger count
    adds starts behind them.

    The points are of a scrambled Sobol sequence; beyond 21201 numbers a start, independent ones.

    >>> random_starts(4, [-1.0, 0.0], 1.0).shape
    (4, 2)
    """
    for name, value, least in (("count", count, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < least:
            raise ValueError(f"{name} must be an integer of at least {least}, got {value!r}")
    lower, upper = real_numbers("lower", detached(lower)), real_numbers("upper", detached(upper))
    try:
        lower, upper = np.broadcast_arrays(lower, upper)
    except ValueError:
        raise ValueError(
            f"lower and upper must fit each other, got {lower.shape} and {upper.shape}"
        ) from None
    if not (np.isfinite(lower) & np.isfinite(upper) & (lower <= upper)).all():
        raise ValueError("lower must be finite and nowhere above upper, which must be finite too")
    fractions = _unit_points(int(count), lower.size, int(seed)).reshape(count, *lower.shape)
    return lower + fractions * (upper - lower)


def _unit_points(count: int, size: int, seed: int) -> np.ndarray:
    """Return points of the unit cube, (count, size)."""
    if 0 < size <= _LONGEST_SOBOL:
        from scipy.stats import qmc  # takes longer to load than all of magshell

        # The sequence is balanced for powers of two only.
        return qmc.Sobol(size, seed=seed).random_base2(math.ceil(math.log2(count)))[:count]
    return np.stack([np.random.default_rng([seed, number]).random(size) for number in range(count)])
