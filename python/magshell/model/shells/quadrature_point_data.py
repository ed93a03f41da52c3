"""Functions of strain and stress at the quadrature points of elements, for solids and for shells."""

from __future__ import annotations

import numpy as np


def mean(volumes: np.ndarray, of_points: np.ndarray) -> np.ndarray:
    """Return the means over the points of each element, (n, ...), of values (n, p, ...) with the volumes (n, p) as
    weights.
    """
    weights = volumes / volumes.sum(axis=1, keepdims=True)
    return np.einsum("tp,tp...->t...", weights, of_points)


def von_mises(stresses: np.ndarray) -> np.ndarray:
    """Return the von Mises stress, (...), of Cauchy stresses (..., 3, 3)."""
    pressure = np.trace(stresses, axis1=-2, axis2=-1)[..., None, None] / 3.0
    deviator = stresses - pressure * np.eye(3)
    return np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1)))
