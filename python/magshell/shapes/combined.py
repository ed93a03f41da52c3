"""Shapes of several."""

from __future__ import annotations

import numpy as np

from .._checks.checked_list import checked_list
from .._checks.scalars import positive
from .shape import Bounds, Shape


def union(*shapes: Shape) -> Shape:
    """All that lies in one of them, `a | b`."""
    return Union(_several("union", shapes))


def intersection(*shapes: Shape) -> Shape:
    """All that lies in each of them, `a & b`."""
    return Intersection(_several("intersection", shapes))


def difference(shape: Shape, *others: Shape) -> Shape:
    """What others leave of a shape, `a - b`."""
    return Difference(_several("difference", (shape, *others)))


def smooth_union(*shapes: Shape, radius: float) -> Shape:
    """The union with its inner edges filled, as flesh fills the space between fingers.

    Args:
        shapes: two or more, joined one after the other.
        radius: m, about that of the fillet. Where the distances a and b of two differ by less than it, theirs is
            min(a, b) - (radius - |a - b|)^2 / (4 radius); a quarter of it is added where they are the same.

    >>> from magshell import shapes
    >>> shapes.smooth_union(shapes.ball(1.0), shapes.ball(1.0), radius=0.4)([2, 0, 0]).item()
    0.9
    """
    return SmoothUnion(_several("smooth_union", shapes), positive("radius", "m", radius))


def _several(name: str, shapes) -> list[Shape]:
    listed = checked_list("shapes", list(shapes), (Shape,), "shapes of ms.shapes")
    if len(listed) < 2:
        raise ValueError(f"{name} needs at least two shapes, got {len(listed)}")
    return list(listed)


class _Combined(Shape):
    sign = "?"

    def __init__(self, shapes: list[Shape]):
        self._shapes = shapes

    def _nearest(self, shapes: list[Shape], points: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """All distances (k, n), whose number at each point, and the names."""
        distances, numbers, names = [], [], []
        for shape in shapes:
            distance, number, own = shape.nearest(points)
            known = [names.index(name) if name in names else len(names) + k for k, name in enumerate(own)]
            names += [name for name in own if name not in names]
            numbers.append(np.append(known, -1).astype(int)[number])
            distances.append(distance)
        stacked = np.stack(distances)
        closest = np.argmin(stacked, axis=0)
        return stacked, np.take_along_axis(np.stack(numbers), closest[None], axis=0)[0], names

    def __repr__(self) -> str:
        return f"({f' {self.sign} '.join(map(repr, self._shapes))})"


class Union(_Combined):
    sign = "|"

    @property
    def bounds(self) -> Bounds:
        lows, highs = zip(*(shape.bounds for shape in self._shapes), strict=True)
        return np.min(lows, axis=0), np.max(highs, axis=0)

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return np.min([shape._distance(points) for shape in self._shapes], axis=0)

    def nearest(self, points: np.ndarray):
        distances, number, names = self._nearest(self._shapes, points)
        return distances.min(axis=0), number, names


class SmoothUnion(Union):
    def __init__(self, shapes: list[Shape], radius: float):
        super().__init__(shapes)
        self._radius = radius

    @property
    def bounds(self) -> Bounds:
        low, high = super().bounds
        # each of the steps may add a quarter of the radius
        most = 0.25 * self._radius * (len(self._shapes) - 1)
        return low - most, high + most

    def _blended(self, distances) -> np.ndarray:
        result = distances[0]
        for other in distances[1:]:
            within = np.maximum(self._radius - np.abs(result - other), 0)
            result = np.minimum(result, other) - within**2 / (4 * self._radius)
        return result

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._blended([shape._distance(points) for shape in self._shapes])

    def nearest(self, points: np.ndarray):
        distances, number, names = self._nearest(self._shapes, points)
        return self._blended(distances), number, names

    def __repr__(self) -> str:
        return f"smooth_union({', '.join(map(repr, self._shapes))}, radius={self._radius:g})"


class Intersection(_Combined):
    sign = "&"

    @property
    def bounds(self) -> Bounds:
        lows, highs = zip(*(shape.bounds for shape in self._shapes), strict=True)
        return np.max(lows, axis=0), np.min(highs, axis=0)

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return np.max([shape._distance(points) for shape in self._shapes], axis=0)

    def nearest(self, points: np.ndarray):
        distances, number, names = self._nearest(self._shapes, points)
        return distances.max(axis=0), number, names


class Difference(_Combined):
    """The first without the others, whose names do not count."""

    sign = "-"

    @property
    def bounds(self) -> Bounds:
        return self._shapes[0].bounds

    def _distance(self, points: np.ndarray) -> np.ndarray:
        taken = np.min([shape._distance(points) for shape in self._shapes[1:]], axis=0)
        return np.maximum(self._shapes[0]._distance(points), -taken)

    def nearest(self, points: np.ndarray):
        _, number, names = self._shapes[0].nearest(points)
        return self._distance(points), number, names
