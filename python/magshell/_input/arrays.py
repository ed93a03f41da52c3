"""Indices and sizes that a caller hands in, checked and converted in one place."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral
from typing import Any

import numpy as np

from .quantity import array_of, real_numbers


def index_array(name: str, values: Any) -> np.ndarray:
    """An int64 copy. Numbers that are not integers are refused rather than truncated."""
    array = array_of(name, values, "hold integer indices")
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must hold integer indices, got dtype {array.dtype}")
    return array.astype(np.int64)


def count(name: str, value: Any, least: int = 1) -> int:
    """How many: an int, or a ValueError that says the name and the limit that was passed."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ValueError(f"{name} must be an integer of at least {least}, got {value!r}")
    if value >= 2**31:
        raise ValueError(f"{name} must be below 2^31, about {2**31:.1e}, got {value!r}")
    return int(value)


def whole_numbers(name: str, values: Any, type: str = "i8") -> np.ndarray:
    """Numbers from a file that are to be of this integer type of numpy's, whatever they were written as."""
    array = np.asarray(values)
    limits = np.iinfo(type)
    wrong = (array != np.trunc(array)) | (array < limits.min) | (array > limits.max)
    if wrong.any():  # NaN among them
        raise ValueError(f"{name} must be integers of {limits.bits} bits, got {array[wrong][0]}")
    return array.astype(type)


def named_values(name: str, values: Any) -> Mapping[Any, Any]:
    """A dictionary, empty for None."""
    if not isinstance(values, Mapping | None):
        raise ValueError(f"{name} must be a dictionary of name: values, got {type(values).__name__}")
    return values or {}


def number(name: str, value: Any) -> float:
    """A float, infinite or not a number as well."""
    array = real_numbers(name, value)
    if array.ndim != 0:
        raise ValueError(f"{name} must be a number, got shape {array.shape}")
    return float(array)
