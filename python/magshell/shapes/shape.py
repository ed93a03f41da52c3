"""What every shape can do."""

from __future__ import annotations

import numpy as np

from .._checks.quantity import quantity
from .._checks.scalars import positive
from ..mesh.transforms import matrix_of

Bounds = tuple[np.ndarray, np.ndarray]


class Shape:
    """A region of space by its signed distance. Made by the functions of `ms.shapes`; immutable.

    Call it with points (n, 3) [m], or one point (3,), for distances [m], negative inside. `bounds` are the lower and
    upper corner (3,) m of a box around it, infinite where it is. The distance is exact for primitives, moved or not; of
    combinations it is exact on the surface, has the right sign everywhere, and is at most the true one.
    """

    name: str | None = None

    def __call__(self, points) -> np.ndarray:
        points = quantity("points", "m", points, ("...", 3))
        return self._distance(points.reshape(-1, 3)).reshape(points.shape[:-1])

    @property
    def bounds(self) -> Bounds:
        raise AttributeError("a Shape without a kind has no bounds: make one by the functions of ms.shapes")

    def _distance(self, points: np.ndarray) -> np.ndarray:
        raise AttributeError("a Shape without a kind has no distance: make one by the functions of ms.shapes")

    def named(self, name: str) -> Shape:
        """The same shape as a part of this name: `from_distance` gives it to the tetrahedra that are nearest to it."""
        if not (isinstance(name, str) and name):
            raise ValueError(f"name must be a word, got {name!r:.60}")
        return Named(self, name)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """Distances (n,), and for each point the number (n,) among the names (k,) of the nearest named shape in it, -1
        for none."""
        return self._distance(points), np.full(len(points), -1), []

    # Put together

    def __or__(self, other) -> Shape:
        return self._with("Union", other)

    def __and__(self, other) -> Shape:
        return self._with("Intersection", other)

    def __sub__(self, other) -> Shape:
        return self._with("Difference", other)

    def _with(self, kind: str, other):
        from . import combined

        return getattr(combined, kind)([self, other]) if isinstance(other, Shape) else NotImplemented

    def smooth_union(self, *others: Shape, radius: float) -> Shape:
        """The union with others, its inner edges filled; see `ms.shapes.smooth_union`."""
        from .combined import smooth_union

        return smooth_union(self, *others, radius=radius)

    # Moved and changed

    def translated(self, translation) -> Shape:
        """Moved by (3,) m."""
        return Placed(self, np.eye(3), quantity("translation", "m", translation, (3,)), 1.0)

    def rotated(self, rotation, center=(0.0, 0.0, 0.0)) -> Shape:
        """Turned about a center (3,) m by a rotation matrix (3, 3) or a scipy Rotation."""
        matrix = matrix_of(rotation)
        if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-9:
            raise ValueError("rotation must be orthogonal: a distance does not survive stretching")
        center = quantity("center", "m", center, (3,))
        return Placed(self, matrix, center - matrix @ center, 1.0)

    def scaled(self, factor: float) -> Shape:
        """All lengths multiplied by a positive factor, from the origin."""
        return Placed(self, np.eye(3), np.zeros(3), positive("factor", "", factor))

    def offset(self, distance: float) -> Shape:
        """Grown by a distance [m] on all sides, its outer edges rounded; shrunk by a negative one."""
        return Offset(self, float(quantity("distance", "m", distance, ())))

    def hollow(self, thickness: float) -> Shape:
        """What is left within `thickness` [m] of its surface: the wall around a chamber."""
        return self - self.offset(-positive("thickness", "m", thickness))


class Named(Shape):
    def __init__(self, shape: Shape, name: str):
        self._shape, self.name = shape, name

    @property
    def bounds(self) -> Bounds:
        return self._shape.bounds

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._shape._distance(points)

    def nearest(self, points: np.ndarray):
        return self._distance(points), np.zeros(len(points), dtype=int), [self.name]

    def __repr__(self) -> str:
        return f"{self._shape!r}.named({self.name!r})"


class Placed(Shape):
    """x -> factor rotation x + translation."""

    def __init__(self, shape: Shape, rotation: np.ndarray, translation: np.ndarray, factor: float):
        self._shape, self._rotation, self._translation, self._factor = shape, rotation, translation, factor

    @property
    def bounds(self) -> Bounds:
        low, high = self._shape.bounds
        # a turned infinite box is taken to be infinite all around, unless it is turned onto the axes
        steps = np.where(np.abs(self._rotation) < 1e-12, 0.0, self._rotation)[:, :, None]
        with np.errstate(invalid="ignore"):
            ends = np.where(steps == 0, 0.0, steps * np.stack([low, high], axis=1))
        ends = self._factor * ends
        return ends.min(axis=2).sum(axis=1) + self._translation, ends.max(axis=2).sum(
            axis=1
        ) + self._translation

    def _back(self, points: np.ndarray) -> np.ndarray:
        return (points - self._translation) @ self._rotation / self._factor

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._factor * self._shape._distance(self._back(points))

    def nearest(self, points: np.ndarray):
        distance, number, names = self._shape.nearest(self._back(points))
        return self._factor * distance, number, names

    def __repr__(self) -> str:
        moved = "" if self._factor == 1 else f".scaled({self._factor:g})"
        if not np.array_equal(self._rotation, np.eye(3)):
            moved += ".rotated(...)"
        if self._translation.any():
            moved += f".translated({', '.join(f'{x:g}' for x in self._translation)})"
        return f"{self._shape!r}{moved}"


class Offset(Shape):
    def __init__(self, shape: Shape, distance: float):
        self._shape, self._by = shape, distance

    @property
    def bounds(self) -> Bounds:
        low, high = self._shape.bounds
        return low - self._by, high + self._by

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._shape._distance(points) - self._by

    def nearest(self, points: np.ndarray):
        distance, number, names = self._shape.nearest(points)
        return distance - self._by, number, names

    def __repr__(self) -> str:
        return f"{self._shape!r}.offset({self._by:g})"
