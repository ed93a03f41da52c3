"""Units and round numbers for the labels of pictures."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class LengthUnit(NamedTuple):
    name: str
    meters: float


_LENGTHS = (LengthUnit("µm", 1e-6), LengthUnit("mm", 1e-3), LengthUnit("m", 1.0), LengthUnit("km", 1e3))
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def length_unit(size: float) -> LengthUnit:
    """Return the unit in which a length [m] is a number between 1 and 1000."""
    return next((unit for unit in reversed(_LENGTHS) if size >= unit.meters), _LENGTHS[0])


def prefixed(value: float, unit: str) -> tuple[float, str]:
    """Choose an SI prefix for a value. Returns (factor, prefixed unit): value / factor is the number in that unit."""
    factor, prefix = next(((f, p) for f, p in _PREFIXES if abs(value) >= f * 0.9995), (1.0, ""))
    return factor, prefix + unit


def with_unit(value: float, unit: str) -> str:
    """Format a magnitude with three digits and a prefixed unit.

    >>> with_unit(0.0057, "T")
    '5.7 mT'
    """
    factor, name = prefixed(value, unit)
    return f"{value / factor:.3g} {name}"


def clock(duration: float) -> Callable[[float], str]:
    """Return a function that formats the times of a motion of a given duration [s], all with the same unit and decimals.

    >>> clock(0.8)(0.25), clock(2.0)(0.25)
    ('250 ms', '0.25 s')
    """
    factor, unit = prefixed(duration, "s")
    decimals = max(0, 2 - int(np.floor(np.log10(duration / factor)))) if duration > 0 else 2
    return lambda time: f"{time / factor:.{decimals}f} {unit}"


def round_below(value: float) -> float:
    """Return the largest number 1, 2 or 5 times a power of ten that is not above a positive value.

    >>> round_below(0.034)
    0.02
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (power, 2 * power, 5 * power) if step <= value * (1 + 1e-12)))
