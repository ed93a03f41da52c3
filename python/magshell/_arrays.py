"""Arrays that a caller hands in, checked and converted in one place."""

from __future__ import annotations

import numpy as np


def real_array(name: str, values, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """A float64 copy; with a shape given, of that shape and finite. ValueErrors say the name."""
    array = np.asarray(values)
    if not np.can_cast(array.dtype, np.float64, casting="same_kind"):
        raise ValueError(f"{name} must hold real numbers, got dtype {array.dtype}")
    if shape is not None and array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
    if shape is not None and not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array.tolist()}")
    return array.astype(np.float64)


def index_array(name: str, values) -> np.ndarray:
    """An int64 copy. Numbers that are not integers are refused rather than truncated."""
    array = np.asarray(values)
    if array.size and not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must hold integer indices, got dtype {array.dtype}")
    return array.astype(np.int64)


def positive(name: str, value) -> float:
    """A positive finite float, or a ValueError that says the name."""
    number = float(value)
    if not (np.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive and finite, got {value}")
    return number
