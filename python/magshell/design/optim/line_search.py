"""Line search for the strong Wolfe conditions on an interval:

    f(a) <= f(0) + c1 a f'(0),     |f'(a)| <= c2 |f'(0)|

Nocedal and Wright, Numerical Optimization (2006), algorithms 3.5 and 3.6; the interval's end is accepted if f still
decreases there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

_DECREASE, _CURVATURE = 1e-4, 0.9
_EXPANSION = 4.0
_SAFEGUARD = 0.1  # [-] smallest distance from a bracket's ends, relative to its length


@dataclass(frozen=True)
class Probe:
    """The value and slope of the objective at a step length, and other results of the evaluation.

    An infinite value means that the design was rejected.
    """

    length: float
    value: float
    slope: float
    found: Any = None


def strong_wolfe(
    probe: Callable[[float], Probe],
    start: Probe,
    first: float,
    longest: float,
    limit: int = 20,
    max_rejected: int = 6,
) -> Probe | None:
    """Return the probe of an acceptable length in (0, longest].

    If the search is cut short, by `limit` steps or by more than `max_rejected` rejections, it is the lowest probe;
    None if none is below the start.
    """

    def falls_short(at: Probe) -> bool:
        return at.value > start.value + _DECREASE * at.length * start.slope

    low, high, at = start, None, probe(min(first, longest))
    rejected = 0
    for _ in range(limit):
        rejected += np.isinf(at.value)
        if rejected > max_rejected:
            break
        if falls_short(at) or (at.value >= low.value and low is not start):
            high = at
        elif abs(at.slope) <= -_CURVATURE * start.slope:
            return at
        elif high is None and at.slope < 0:
            if at.length >= longest:
                return at
            low = at
        else:
            if high is None or at.slope * (high.length - low.length) >= 0:
                high = low
            low = at
        length = min(_EXPANSION * low.length, longest) if high is None else _between(low, high)
        if length in (low.length, getattr(high, "length", None)):
            break
        at = probe(length)
    if not falls_short(at):
        return at
    return low if low is not start else None


def _between(low: Probe, high: Probe) -> float:
    """Return the minimum of the cubic through both ends' values and slopes, at a distance from the ends. [NW06]
    (3.59)"""
    width = high.length - low.length
    d1 = low.slope + high.slope - 3 * (low.value - high.value) / (low.length - high.length)
    discriminant = d1 * d1 - low.slope * high.slope
    if np.isfinite(discriminant) and discriminant >= 0:
        d2 = np.copysign(np.sqrt(discriminant), width)
        denominator = high.slope - low.slope + 2 * d2
        fraction = 1 - (high.slope + d2 - d1) / denominator if denominator != 0 else 0.5
    else:
        fraction = 0.5
    return low.length + width * min(max(fraction, _SAFEGUARD), 1 - _SAFEGUARD)
