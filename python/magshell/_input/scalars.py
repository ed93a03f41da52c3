"""Checks single numbers and switches that a caller passes in."""

from __future__ import annotations

from typing import Any

import numpy as np

from .quantity import label, quantity


def positive(name: str, unit: str, value: Any) -> float:
    """Return a positive finite number. Raises ValueError with the name and the unit ("" for a dimensionless number)."""
    number = float(quantity(name, unit, value, ()))
    if number <= 0:
        raise ValueError(f"{label(name, unit)} must be positive, got {number:g}")
    return number


def not_negative(name: str, unit: str, value: Any) -> float:
    """Return a finite number of at least zero. Raises ValueError with the name and the unit."""
    number = float(quantity(name, unit, value, ()))
    if number < 0:
        raise ValueError(f"{label(name, unit)} must not be negative, got {number:g}")
    return number


def all_positive(name: str, unit: str, values: Any, shape: tuple[int | str, ...]) -> np.ndarray:
    """Return an array of positive finite numbers. Raises ValueError that names the first other entry."""
    array = quantity(name, unit, values, shape)
    if (wrong := np.argwhere(array <= 0)).size:
        index = tuple(wrong[0].tolist())
        entry = f"{name}[{', '.join(map(str, index))}]"
        raise ValueError(f"{label(name, unit)} must be positive, but {entry} is {array[index]:g}")
    return array


def flag(name: str, value: Any) -> bool:
    """Return a boolean as it is. Raises ValueError with the name on anything else than True or False."""
    if not isinstance(value, bool):
        raise ValueError(f"{name} must be True or False, got {value!r:.60}")
    return value
