"""What strain and stress at the points of elements have in common, of solids and of shells."""

from __future__ import annotations

import numpy as np


def mean(volumes: np.ndarray, of_points: np.ndarray) -> np.ndarray:
    """Of each element, (n, ...), weighed by the volumes (n, p): of (n, p, ...)."""
    weights = volumes / volumes.sum(axis=1, keepdims=True)
    return np.einsum("tp,tp...->t...", weights, of_points)


def von_mises(stresses: np.ndarray) -> np.ndarray:
    """(...), of Cauchy stresses (..., 3, 3)."""
    pressure = np.trace(stresses, axis1=-2, axis2=-1)[..., None, None] / 3.0
    deviator = stresses - pressure * np.eye(3)
    return np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1)))
