"""Values at points as values on a regular grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


_SAME = 1e-6  # of the extent along an axis: as many digits as tables have
_NEIGHBORS = 40  # that a value between scattered points is made from
_HELD_BACK = 10  # every so many-th point tells the error


class Grid(NamedTuple):
    """origin, spacing (3,) m; values (nx, ny, nz, 3); error: rms, where values are not those of the points."""

    origin: np.ndarray
    spacing: np.ndarray
    values: np.ndarray
    error: float | None


def as_they_lie(points: np.ndarray, values: np.ndarray) -> Grid | None:
    """Where the points are a regular grid in any order; None where they are not."""
    extent = np.ptp(points, axis=0)
    lower = points.min(axis=0)
    numbers, counts, spacing = [], [], []
    for axis in range(3):
        places = np.unique(np.rint((points[:, axis] - lower[axis]) / max(_SAME * extent[axis], 1e-300)))
        count = len(places)
        step = extent[axis] / max(count - 1, 1)
        number = np.rint((points[:, axis] - lower[axis]) / step) if count > 1 else np.zeros(len(points))
        off = np.abs(points[:, axis] - lower[axis] - number * step).max()
        if count > 1 and off > 1e-3 * step:
            return None
        numbers.append(number.astype(np.int64))
        counts.append(count)
        spacing.append(step)
    if np.prod(counts) != len(points):
        return None
    flat = np.ravel_multi_index(tuple(numbers), tuple(counts))
    if len(np.unique(flat)) != len(points):
        return None
    rows = np.empty_like(values)
    rows[flat] = values
    return Grid(lower, np.array(spacing), rows.reshape(*counts, 3), None)


def interpolated(
    points: np.ndarray, values: np.ndarray, lower: Numbers, upper: Numbers, counts: Sequence[int]
) -> Grid:
    """On a grid of `counts` between two corners, by cubic functions of the distance to the nearest points.

    Raises ValueError where points lie on each other, or where the grid goes beyond them.
    """
    extent = np.ptp(points, axis=0)
    axes = np.flatnonzero(extent > _SAME * extent.max(initial=0.0))
    if len(axes) == 0 or len(points) < 2 * _NEIGHBORS:
        raise ValueError(
            f"the table has {len(points)} points, too few to interpolate between: at least {2 * _NEIGHBORS}"
        )
    if any(counts[axis] > 1 for axis in set(range(3)) - set(axes)):
        raise ValueError(
            f"the table has a single place along an axis: counts must be 1 there, got {list(counts)}"
        )
    lines = [
        np.linspace(low, high, count) if count > 1 else np.array([(low + high) / 2])
        for low, high, count in zip(lower, upper, counts, strict=True)
    ]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    scaled = (points[:, axes] - points[:, axes].min(axis=0)) / extent[axes]
    wanted = (grid[:, axes] - points[:, axes].min(axis=0)) / extent[axes]
    _refuse_beyond(scaled, wanted, grid, axes)
    if len(np.unique(np.rint(scaled / _SAME), axis=0)) != len(points):
        raise ValueError("two points of the table are the same")
    chosen = np.arange(len(points)) % _HELD_BACK != 0
    guess = _between(scaled[chosen], values[chosen], scaled[~chosen])
    error = float(np.sqrt(((guess - values[~chosen]) ** 2).sum(axis=1).mean()))
    found = _between(scaled, values, wanted).reshape(*counts, 3)
    spacing = [(line[-1] - line[0]) / max(len(line) - 1, 1) for line in lines]
    return Grid(np.array([line[0] for line in lines]), np.array(spacing), found, error)


def _between(points: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    from scipy.interpolate import RBFInterpolator  # when needed, as loading it takes long

    return RBFInterpolator(points, values, neighbors=_NEIGHBORS, kernel="cubic")(wanted)


def _refuse_beyond(points: np.ndarray, wanted: np.ndarray, grid: np.ndarray, axes: np.ndarray) -> None:
    if len(axes) == 1:
        outside = (wanted[:, 0] < -_SAME) | (wanted[:, 0] > 1.0 + _SAME)
    else:
        outside = scipy.spatial.Delaunay(points).find_simplex(wanted, tol=_SAME) < 0
    if outside.any():
        place = ", ".join(f"{value:.4g}" for value in grid[int(np.argmax(outside))])
        raise ValueError(
            f"the grid's point ({place}) m lies outside the points of the table: give `lower` and `upper` [m] within them"
        )
