"""Indices that a caller hands in."""

from __future__ import annotations

import numpy as np


def indices(name: str, values, count: int) -> np.ndarray:
    """Distinct indices into `count` things, (k,), k > 0."""
    array = np.atleast_1d(np.asarray(values))
    if array.dtype == bool:
        if array.shape != (count,):
            raise ValueError(f"{name}: a mask must have shape ({count},), got {array.shape}")
        array = np.flatnonzero(array)
    if array.ndim != 1 or not np.issubdtype(array.dtype, np.integer):
        raise ValueError(f"{name} must be integer indices of shape (k,), got {array.dtype} of shape {array.shape}")
    if array.size == 0:
        raise ValueError(f"{name} are empty: there is nothing to apply this to")
    if array.min() < 0 or array.max() >= count:
        bad = array[(array < 0) | (array >= count)][0]
        raise ValueError(f"{name} must be in [0, {count}), got {bad}")
    if len(np.unique(array)) != len(array):
        values, counts = np.unique(array, return_counts=True)
        raise ValueError(f"{name} must not repeat, but {values[counts > 1][0]} does")
    return array.astype(np.int64)
