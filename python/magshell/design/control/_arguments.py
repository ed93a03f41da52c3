"""Checks arguments of this package and converts them to torch tensors in their graph."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._input.quantity import array_of, quantity
from ..._input.tensors import detached, is_tensor, require_torch


def tensor(name: str, unit: str, value: Any, shape: tuple[int | str, ...]):
    """Return finite numbers of this shape as a float64 tensor; letters in the shape stand for any size."""
    torch = require_torch("ms.control")
    numbers = quantity(name, unit, detached(value), shape)
    return value.to("cpu", torch.float64) if is_tensor(value) else torch.tensor(numbers)


def indices(name: str, value: Any, size: int):
    """Return integers within -size ... size - 1, one or a row, as a tensor; negative ones count from the end."""
    torch = require_torch("ms.control")
    given = array_of(name, value, "be an integer or a row of them")
    if given.ndim > 1 or given.size == 0 or not np.issubdtype(given.dtype, np.integer):
        raise ValueError(
            f"{name} must be an integer or a row of them, got {given.dtype} of shape {given.shape}"
        )
    if given.min() < -size or given.max() >= size:
        raise ValueError(f"{name} must lie in {-size} ... {size - 1}, got {given.min()} ... {given.max()}")
    return torch.as_tensor(given.astype(np.int64))
