"""Closed cubic B-splines with uniform knots."""

from __future__ import annotations

import numpy as np

LEAST_CONTROLS = 4  # control points of a closed cubic spline


def closed_spline(at: np.ndarray, count: int) -> np.ndarray:
    """Return the closed uniform cubic B-splines of `count` control points at parameters (n,) in [0, count), (n, count)."""
    first, t = np.floor(at).astype(int), at - np.floor(at)
    weights = np.stack(
        [(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1
    )
    splines = np.zeros((len(at), count))
    for k in range(4):
        np.add.at(splines, (np.arange(len(at)), (first + k - 1) % count), weights[:, k] / 6.0)
    return splines
