"""Indices and sizes that a caller hands in, checked and converted in one place."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ._quantity import real_numbers


def index_array(name: str, values) -> np.ndarray:
    """An int64 copy. Numbers that are not integers are refused rather than truncated."""
    try:
        array = np.asarray(values)
    except ValueError as error:  # a ragged list
        raise ValueError(f"{name} must hold integer indices: {error}") from None
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must hold integer indices, got dtype {array.dtype}")
    return array.astype(np.int64)


def named_values(name: str, values) -> Mapping:
    """A dictionary, empty for None."""
    if not isinstance(values, Mapping | None):
        raise ValueError(f"{name} must be a dictionary of name: values, got {type(values).__name__}")
    return values or {}


def positive(name: str, value) -> float:
    """A positive finite float, or a ValueError that says the name."""
    array = real_numbers(name, value)
    if array.ndim != 0:
        raise ValueError(f"{name} must be a number, got shape {array.shape}")
    number = float(array)
    if not (np.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
    return number
