"""Indices that a caller hands in."""

from __future__ import annotations

from typing import Any

import numpy as np

from .quantity import array_of


def selection(name: str, values: Any) -> np.ndarray:
    """Indices, or a mask, as they were given: (k,), k > 0. `indices` checks them once their mesh is known."""
    array = np.atleast_1d(array_of(name, values, "be integer indices of shape (k,)"))
    if array.size == 0:
        raise ValueError(f"{name} are empty: there is nothing to apply this to")
    if array.ndim != 1 or not (array.dtype == bool or np.issubdtype(array.dtype, np.integer)):
        what = f"{values!r:.60}" if np.ndim(values) == 0 else f"{array.dtype} of shape {array.shape}"
        raise ValueError(f"{name} must be integer indices of shape (k,), got {what}")
    return array


def indices(name: str, array: np.ndarray, count: int) -> np.ndarray:
    """A selection as distinct indices into `count` things, (k,), k > 0."""
    if array.dtype == bool:
        if array.shape != (count,):
            raise ValueError(f"{name}: a mask must have shape ({count},), got {array.shape}")
        array = np.flatnonzero(array)
        if array.size == 0:
            raise ValueError(f"{name} are empty: the mask is False everywhere")
    if array.min() < 0 or array.max() >= count:
        bad = array[(array < 0) | (array >= count)][0]
        raise ValueError(f"{name} must be in [0, {count}), got {bad}")
    if len(np.unique(array)) != len(array):
        values, counts = np.unique(array, return_counts=True)
        raise ValueError(f"{name} must not repeat, but {values[counts > 1][0]} does")
    return array.astype(np.int64)
