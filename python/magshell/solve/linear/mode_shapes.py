"""Converts eigenvectors of the free degrees of freedom to mode shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ... import _core


def mode_shapes(model: _core.Model, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacements (k, n_v, 3) and the edge rotations (k, n_e) of eigenvectors (n, k).

    Each is scaled so that its largest component of displacement is 1.
    """
    shapes = [_normalized(model, vector) for vector in vectors.T]
    return (
        np.array([model.positions(shape) for shape in shapes]),
        np.array([model.edge_rotations(shape) for shape in shapes]),
    )


def _normalized(model, vector: np.ndarray) -> np.ndarray:
    """Return one mode scaled by its largest displacement of a vertex, or of a link where no vertex moves."""
    shape = model.expand(vector)
    vertices, links = model.positions(shape), model.points(shape)
    moved = np.abs(vertices).max(initial=0.0) > _STILL * np.abs(links).max(initial=0.0)
    displacements = vertices if moved else links
    return shape / displacements.ravel()[np.argmax(np.abs(displacements))]


_STILL = 1e-9  # [-] of the largest displacement of a link: vertices that move less do not move
