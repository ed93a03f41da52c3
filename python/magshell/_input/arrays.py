"""Checks and converts the integer indices, counts and numbers that a caller passes in."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral
from typing import Any

import numpy as np

from .quantity import array_of, real_numbers


def index_array(name: str, values: Any) -> np.ndarray:
    """Return the indices as an int64 copy. Raises ValueError on numbers that are not integers instead of truncating
    them."""
    array = array_of(name, values, "hold integer indices")
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must hold integer indices, got dtype {array.dtype}")
    return array.astype(np.int64)


def count(name: str, value: Any, least: int = 1) -> int:
    """Return a count as an int. Raises ValueError, with the name and the violated limit, below `least` or from 2^31
    on."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ValueError(f"{name} must be an integer of at least {least}, got {value!r}")
    if value >= 2**31:
        raise ValueError(f"{name} must be below 2^31, about {2**31:.1e}, got {value!r}")
    return int(value)


def integer_array(name: str, values: Any, type: str = "i8") -> np.ndarray:
    """Return numbers read from a file as an array of this integer type of numpy's, whatever type they were written
    in.

    Raises ValueError if a number has a fraction, does not fit the type, or is NaN.
    """
    array = np.asarray(values)
    limits = np.iinfo(type)
    wrong = (array != np.trunc(array)) | (array < limits.min) | (array > limits.max)
    if wrong.any():  # NaN among them
        raise ValueError(f"{name} must be integers of {limits.bits} bits, got {array[wrong][0]}")
    return array.astype(type)


def named_values(name: str, values: Any) -> Mapping[Any, Any]:
    """Return the dictionary as it is, and an empty one for None. Raises ValueError on anything else."""
    if not isinstance(values, Mapping | None):
        raise ValueError(f"{name} must be a dictionary of name: values, got {type(values).__name__}")
    return values or {}


def number(name: str, value: Any) -> float:
    """Return a number as a float, which may be infinite or NaN."""
    array = real_numbers(name, value)
    if array.ndim != 0:
        raise ValueError(f"{name} must be a number, got shape {array.shape}")
    return float(array)
