"""Computes winding numbers of closed triangle meshes, which tell points inside from points outside."""

from __future__ import annotations

import numpy as np

_TOGETHER = 2**20  # pairs of a point and a triangle that are in memory at the same time


def winding_numbers(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the winding numbers of closed triangles (m, 3, 3) m about points (n, 3) m, (n,).

    It is the sum of solid angles over 4 pi (van Oosterom and Strackee 1983): 1 inside, 0 outside, between them on the
    surface.
    """
    numbers = np.zeros(len(points))
    size = max(1, _TOGETHER // max(len(corners), 1))
    for first in range(0, len(points) if len(corners) else 0, size):
        a, b, c = np.moveaxis(corners[None] - points[first : first + size, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(each, axis=-1) for each in (a, b, c))
        ab, bc, ca = (np.einsum("...i,...i", p, q) for p, q in ((a, b), (b, c), (c, a)))
        volume = np.einsum("...i,...i", a, np.cross(b, c))
        angles = 2 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
        numbers[first : first + size] = angles.sum(axis=1) / (4 * np.pi)
    return numbers
