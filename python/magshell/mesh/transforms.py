"""Affine transformations of points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._input.quantity import quantity

if TYPE_CHECKING:
    from .._input.kinds import Numbers, Rotates


def moved(
    positions: np.ndarray, rotation: Rotates | None = None, translation: Numbers | None = None
) -> np.ndarray:
    """Return rotation x + translation for each position x, (n, 3) m.

    rotation: an invertible (3, 3) matrix or a scipy Rotation. translation: (3,), m.
    """
    if rotation is not None:
        positions = positions @ matrix_of(rotation).T
    if translation is not None:
        positions = positions + quantity("translation", "m", translation, (3,))
    return positions


def matrix_of(rotation: Numbers) -> np.ndarray:
    """Return a matrix or a scipy Rotation as a matrix (3, 3). Raises ValueError if it is singular."""
    as_matrix = getattr(rotation, "as_matrix", None)
    matrix = quantity("rotation", "1", as_matrix() if as_matrix else rotation, (3, 3))
    if abs(np.linalg.det(matrix)) <= 1e-12 * np.linalg.norm(matrix) ** 3:
        raise ValueError("rotation is singular: it would flatten the mesh")
    return matrix
