"""Arguments of this package: checked once, as torch tensors that keep their graph."""

from __future__ import annotations

from numbers import Integral

import numpy as np

from .._quantity import quantity
from .._tensors import detached, is_tensor, require_torch


def tensor(name: str, unit: str, value, shape: tuple[int | str, ...]):
    """Finite numbers of this shape, in which letters stand for any size, as a float64 tensor."""
    torch = require_torch("ms.control")
    numbers = quantity(name, unit, detached(value), shape)
    return value.to("cpu", torch.float64) if is_tensor(value) else torch.tensor(numbers)


def count(name: str, value, least: int = 1) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ValueError(f"{name} must be an integer of at least {least}, got {value!r}")
    if value >= 2**31:
        raise ValueError(f"{name} must be below 2^31, got {value!r}")
    return int(value)


def indices(name: str, value, size: int):
    """Integers within -size ... size - 1, one or a row, as a tensor; those below zero count from the end."""
    torch = require_torch("ms.control")
    given = np.asarray(detached(value))
    if given.ndim > 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(
            f"{name} must be an integer or a row of them, got {given.dtype} of shape {given.shape}"
        )
    if given.min() < -size or given.max() >= size:
        raise ValueError(f"{name} must lie in {-size} ... {size - 1}, got {given.min()} ... {given.max()}")
    return torch.as_tensor(given.astype(np.int64))
