"""Eigenvectors of free unknowns as shapes of the sheet."""

from __future__ import annotations

import numpy as np


def mode_shapes(model, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (k, n_v, 3), the largest component of each mode 1, and edge rotations (k, n_e) of vectors (n, k)."""
    shapes = [_normalized(model, vector) for vector in vectors.T]
    return (
        np.array([model.positions(shape) for shape in shapes]),
        np.array([model.edge_rotations(shape) for shape in shapes]),
    )


def _normalized(model, vector: np.ndarray) -> np.ndarray:
    shape = model.expand(vector)
    displacements = model.positions(shape)
    return shape / displacements.ravel()[np.argmax(np.abs(displacements))]
