"""Borders and slits of a flat sheet, each a curve that depends linearly on a few control numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensors import detached
from ..._runtime.frozen import Frozen

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_SAMPLES = 16  # points of a span of a spline, from which its length is estimated
LEAST_CHORDS = 12  # of a circle


LEAST_CONTROLS = 4  # control points of a closed cubic spline


class Border(Frozen, ABC):
    """A curve in the plane by control numbers. start: those it begins with, an array. is_closed: whether it is a loop."""

    start: np.ndarray
    is_closed = True
    side_name = "side"  # of the curve between two control points, in messages and names of groups

    @abstractmethod
    def matrix(self, controls: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return points on the curve as a linear map of the control numbers, and the side on which each lies.

        size [m] limits the distance of neighbours on curved sides; the points are fixed shares of the curve.
        Returns (n, 2, k) for the k flattened control numbers, and (n,).
        """

    def shortcoming(self, controls: np.ndarray, size: float) -> str | None:
        """Return why the curve is too small for faces of a given size [m], or None."""
        return None


class Polygon(Border):
    """A border with straight sides between its control points, which are its corners.

    points: (k, 2) m, at least three, in either direction, without a repeated first one. Side k lies between the points k and
    k + 1.

    >>> import magshell as ms
    >>> ms.parametrize.Polygon([(0, 0), (1, 0), (0, 1)]).start.shape
    (3, 2)
    """

    def __init__(self, points: Numbers):
        self.start: np.ndarray = _points(points, 3)

    def matrix(self, controls: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners; see `Border.matrix`."""
        return _of_points(np.eye(len(controls))), np.arange(len(controls))


class ClosedSpline(Border):
    """A border that is a closed uniform cubic B-spline, smooth everywhere.

    points: (k, 2) m, at least four control points. The border passes near them, at (1, 4, 1) / 6 of three neighbours.

    >>> import magshell as ms
    >>> ms.parametrize.ClosedSpline([(0, 0), (1, 0), (1, 1), (0, 1)]).start.shape
    (4, 2)
    """

    def __init__(self, points: Numbers):
        self.start: np.ndarray = _points(points, LEAST_CONTROLS)

    def matrix(self, controls: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return points at most `size` [m] from each other; see `Border.matrix`."""
        count = len(controls)
        dense = closed_spline(np.arange(count * _SAMPLES) / _SAMPLES, count) @ controls
        lengths = np.linalg.norm(np.roll(dense, -1, axis=0) - dense, axis=1).reshape(count, -1).sum(axis=1)
        parts = np.maximum(1, np.ceil(lengths / size)).astype(int)
        sides = np.repeat(np.arange(count), parts)
        within = np.concatenate([np.arange(n) / n for n in parts])
        return _of_points(closed_spline(sides + within, count)), sides


class Circle(Border):
    """A circular border; its control numbers are the center and the radius, (x, y, r) m.

    The mesh has a polygon of the same area in its place.

    >>> import magshell as ms
    >>> ms.parametrize.Circle((0.01, 0.02), radius=0.005).start.tolist()
    [0.01, 0.02, 0.005]
    """

    side_name = "chord"

    def __init__(self, center: Numbers, radius: float):
        middle = quantity("center", "m", detached(center), (2,))
        self.start: np.ndarray = np.append(middle, quantity("radius", "m", detached(radius), ()))

    def matrix(self, controls: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the polygon; see `Border.matrix`."""
        count = max(LEAST_CHORDS, int(np.ceil(2.0 * np.pi * controls[2] / size)))
        angle = 2.0 * np.pi / count
        angles = angle * np.arange(count)
        outwards = np.sqrt(angle / np.sin(angle)) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        found = np.zeros((count, 2, 3))
        found[:, 0, 0] = found[:, 1, 1] = 1.0
        found[:, :, 2] = outwards
        return found, np.arange(count)

    def shortcoming(self, controls: np.ndarray, size: float) -> str | None:
        """Return why the circle is too small, or None; see `Border.shortcoming`."""
        if controls[2] < size:
            return f"has the radius {controls[2]:.3g} m, below the size of a face, {size:.3g} m"
        return None


class Slit(Border):
    """A cut of zero width along a polyline inside the sheet, as in kirigami; its control points are its points.

    points: (k, 2) m, at least two. Both ends stay joined, so the slit must not reach a border or another slit.

    >>> import magshell as ms
    >>> ms.parametrize.Slit([(0.3, 0.5), (0.7, 0.5)]).start.shape
    (2, 2)
    """

    is_closed = False

    def __init__(self, points: Numbers):
        self.start: np.ndarray = _points(points, 2)

    def matrix(self, controls: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the points; see `Border.matrix`."""
        return _of_points(np.eye(len(controls))), np.arange(len(controls))

    def shortcoming(self, controls: np.ndarray, size: float) -> str | None:
        """Return why the slit is too short to open, or None; see `Border.shortcoming`."""
        length = np.linalg.norm(np.diff(controls, axis=0), axis=1).sum()
        if length < 2.0 * size:
            return f"is {length:.3g} m long, less than two faces of the size {size:.3g} m, and would not open"
        return None


def _points(points: Numbers, least: int) -> np.ndarray:
    """Return control points (k, 2) m as an array. Raises ValueError for fewer than `least`."""
    found = np.array(quantity("points", "m", detached(points), ("k", 2)))
    if len(found) < least:
        raise ValueError(f"points [m] must have at least {least} rows, got {len(found)}")
    return found


def _of_points(weights: np.ndarray) -> np.ndarray:
    """Return weights (n, k) of control points as a map of their coordinates, (n, 2, 2 k)."""
    n, k = weights.shape
    return np.einsum("nk,ij->nikj", weights, np.eye(2)).reshape(n, 2, 2 * k)


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
