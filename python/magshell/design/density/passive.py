"""Faces of a design whose density does not change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.tensors import require_torch
from .cells import checked_density

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def fixed(density: Numbers, solid: Numbers = (), void: Numbers = ()) -> torch.Tensor:
    """Return the densities (n_f,), with 1 on some faces, and 0 on others.

    Apply it last, after filter and projection, to faces that supports, loads and other parts need.

    density: (n_f,) in [0, 1]. solid, void: indices of faces.

    >>> import magshell as ms
    >>> ms.parametrize.density.fixed([0.5, 0.5, 0.5], solid=[0], void=[2])
    tensor([1.0000, 0.5000, 0.0000], dtype=torch.float64)
    """
    torch = require_torch("parametrize.density.fixed")
    density = checked_density("density", density, "n_f")
    full, empty = (faces_among(name, each, len(density)) for name, each in (("solid", solid), ("void", void)))
    both = np.intersect1d(full, empty)
    if len(both):
        raise ValueError(f"face {both[0]} is among the solid and the void faces")
    return density.index_fill(0, torch.tensor(full), 1.0).index_fill(0, torch.tensor(empty), 0.0)


def faces_among(name: str, faces: Any, count: int) -> np.ndarray:
    """Return distinct indices of faces, ascending. Raises ValueError for those that are out of range."""
    chosen = np.unique(index_array(name, faces).ravel())
    if len(chosen) and not 0 <= chosen[0] <= chosen[-1] < count:
        wrong = chosen[0] if chosen[0] < 0 else chosen[-1]
        raise ValueError(f"{name} names face {wrong}, but they are numbered 0 to {count - 1}")
    return chosen
