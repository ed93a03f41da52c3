"""The base class of shapes described by signed distances, their combinations and transformations."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ..._input.checked_list import checked_list
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._runtime.frozen import Frozen
from ..transforms import matrix_of

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Rotates


Bounds = tuple[np.ndarray, np.ndarray]


class Shape(Frozen):
    """A region of space described by its signed distance. Made by the functions of `ms.shapes`; immutable.

    A shape is called with points (n, 3) [m], or one point (3,), and returns distances [m], negative inside. `bounds` are the
    lower and upper corners (3,) m of a box around it, infinite for an unbounded shape. The distance of primitives is exact,
    also after a transformation. That of combinations is exact on the surface, has the right sign everywhere, and its
    magnitude is at most that of the true distance.
    """

    name: str | None = None

    def __call__(self, points: Numbers) -> np.ndarray:
        points = quantity("points", "m", points, ("...", 3))
        return self._distance(points.reshape(-1, 3)).reshape(points.shape[:-1])

    @property
    def bounds(self) -> Bounds:
        """The lower and the upper corner of a box around the shape, each (3,) m."""
        raise AttributeError("a Shape without a kind has no bounds: make one by the functions of ms.shapes")

    def _distance(self, points: np.ndarray) -> np.ndarray:
        raise AttributeError("a Shape without a kind has no distance: make one by the functions of ms.shapes")

    def named(self, name: str) -> Shape:
        """Return the same shape as a part with this name.

        `ms.meshes.from_distance` gives the name to the tetrahedra that are nearest to this shape.
        """
        if not (isinstance(name, str) and name):
            raise ValueError(f"name must be a word, got {name!r:.60}")
        return Named(self, name)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """Return the distances of points (n, 3), and the named part of the shape that is nearest to each point.

        Returns distances (n,) m, the index of the part in the list of names, (n,), -1 for none, and that list (k,).
        """
        return self._distance(points), np.full(len(points), -1), []

    # Combinations

    # An operator that returns NotImplemented lets Python try the other operand, and then raise TypeError.
    def __or__(self, other: Shape) -> Shape:
        return Union([self, other]) if isinstance(other, Shape) else NotImplemented

    def __and__(self, other: Shape) -> Shape:
        return Intersection([self, other]) if isinstance(other, Shape) else NotImplemented

    def __sub__(self, other: Shape) -> Shape:
        return Difference([self, other]) if isinstance(other, Shape) else NotImplemented

    def smooth_union(self, *others: Shape, radius: float) -> Shape:
        """Return the union with other shapes, with its concave edges rounded; see `ms.shapes.smooth_union`."""
        return SmoothUnion(several("smooth_union", (self, *others)), positive("radius", "m", radius))

    # Transformations

    def translated(self, translation: Numbers) -> Shape:
        """Return the shape moved by a translation (3,) m."""
        return Transformed(self, np.eye(3), quantity("translation", "m", translation, (3,)), 1.0)

    def rotated(self, rotation: Rotates, center: Numbers = (0.0, 0.0, 0.0)) -> Shape:
        """Return the shape rotated about a center (3,) m by a rotation matrix (3, 3) or a scipy Rotation."""
        matrix = matrix_of(rotation)
        if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-9:
            raise ValueError(
                "rotation must be orthogonal: a matrix that stretches would falsify the distances"
            )
        center = quantity("center", "m", center, (3,))
        return Transformed(self, matrix, center - matrix @ center, 1.0)

    def scaled(self, factor: float) -> Shape:
        """Return the shape scaled by a positive factor about the origin."""
        return Transformed(self, np.eye(3), np.zeros(3), positive("factor", "", factor))

    def offset(self, distance: float) -> Shape:
        """Return the shape grown by a distance [m] on all sides, convex edges rounded; a negative distance shrinks it."""
        return Offset(self, float(quantity("distance", "m", distance, ())))

    def hollow(self, thickness: float) -> Shape:
        """Return the wall of the shape, hollow inside: its points within `thickness` [m] of its surface."""
        return self - self.offset(-positive("thickness", "m", thickness))


class Named(Shape):
    """A shape that is a named part."""

    name: str

    def __init__(self, shape: Shape, name: str):
        self._shape, self.name = shape, name

    @property
    def bounds(self) -> Bounds:
        return self._shape.bounds

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._shape._distance(points)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        return self._distance(points), np.zeros(len(points), dtype=int), [self.name]

    def __repr__(self) -> str:
        return f"{self._shape!r}.named({self.name!r})"


class Transformed(Shape):
    """A shape moved by the similarity transformation x -> factor rotation x + translation."""

    def __init__(self, shape: Shape, rotation: np.ndarray, translation: np.ndarray, factor: float):
        self._shape, self._rotation, self._translation, self._factor = shape, rotation, translation, factor

    @property
    def bounds(self) -> Bounds:
        low, high = self._shape.bounds
        # a rotated infinite box is taken to be infinite in all directions, unless its axes are rotated onto the axes
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

    def nearest(self, points: np.ndarray) -> np.ndarray:
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
    """A shape grown or shrunk by a distance."""

    def __init__(self, shape: Shape, distance: float):
        self._shape, self._by = shape, distance

    @property
    def bounds(self) -> Bounds:
        low, high = self._shape.bounds
        return low - self._by, high + self._by

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._shape._distance(points) - self._by

    def nearest(self, points: np.ndarray) -> np.ndarray:
        distance, number, names = self._shape.nearest(points)
        return distance - self._by, number, names

    def __repr__(self) -> str:
        return f"{self._shape!r}.offset({self._by:g})"


def several(name: str, shapes: Iterable[Shape]) -> list[Shape]:
    """Check that two or more shapes are given, and return them as a list. name: the function that its message names."""
    listed = checked_list("shapes", list(shapes), (Shape,), "shapes of ms.shapes", repeats=True)
    if len(listed) < 2:
        raise ValueError(f"{name} needs at least two shapes, got {len(listed)}")
    return list(listed)


class _Combined(Shape):
    sign = "?"

    def __init__(self, shapes: list[Shape]):
        self._shapes = shapes

    def _nearest(self, shapes: list[Shape], points: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
        """Return the distances of all shapes, (k, n) m, the named part nearest to each point, (n,), and the names."""
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

    def nearest(self, points: np.ndarray) -> np.ndarray:
        distances, number, names = self._nearest(self._shapes, points)
        return distances.min(axis=0), number, names


class SmoothUnion(Union):
    def __init__(self, shapes: list[Shape], radius: float):
        super().__init__(shapes)
        self._radius = radius

    @property
    def bounds(self) -> Bounds:
        low, high = super().bounds
        # each union may grow the shape by a quarter of the radius
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

    def nearest(self, points: np.ndarray) -> np.ndarray:
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

    def nearest(self, points: np.ndarray) -> np.ndarray:
        distances, number, names = self._nearest(self._shapes, points)
        return distances.max(axis=0), number, names


class Difference(_Combined):
    """The first shape without the others; part names of the others are ignored."""

    sign = "-"

    @property
    def bounds(self) -> Bounds:
        return self._shapes[0].bounds

    def _distance(self, points: np.ndarray) -> np.ndarray:
        taken = np.min([shape._distance(points) for shape in self._shapes[1:]], axis=0)
        return np.maximum(self._shapes[0]._distance(points), -taken)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        _, number, names = self._shapes[0].nearest(points)
        return self._distance(points), number, names


def union(*shapes: Shape) -> Shape:
    """Return the union of shapes, `a | b`: the points that lie in at least one of them.

    >>> import magshell as ms
    >>> two = ms.shapes.union(ms.shapes.ball(0.01), ms.shapes.ball(0.01, center=(0.03, 0, 0)))
    >>> bool(two([(0.03, 0, 0)])[0] < 0)
    True
    """
    return Union(several("union", shapes))


def intersection(*shapes: Shape) -> Shape:
    """Return the intersection of shapes, `a & b`: the points that lie in all of them.

    >>> import magshell as ms
    >>> lens = ms.shapes.intersection(ms.shapes.ball(0.01), ms.shapes.ball(0.01, center=(0.01, 0, 0)))
    >>> bool(lens([(0.015, 0, 0)])[0] > 0)
    True
    """
    return Intersection(several("intersection", shapes))


def difference(shape: Shape, *others: Shape) -> Shape:
    """Return the difference of shapes, `a - b`: the points of the first shape that lie in none of the others.

    >>> import magshell as ms
    >>> bowl = ms.shapes.difference(ms.shapes.ball(0.01), ms.shapes.ball(0.008))
    >>> bool(bowl([(0, 0, 0)])[0] > 0)
    True
    """
    return Difference(several("difference", (shape, *others)))


def smooth_union(*shapes: Shape, radius: float) -> Shape:
    """Return the union of shapes with its concave edges rounded by fillets.

    Args:
        shapes: two or more, joined one after the other.
        radius: m, about the radius of the fillets. Where the distances a and b of two shapes differ by less than this, the
            combined distance is min(a, b) - (radius - |a - b|)^2 / (4 radius); it grows the shape by at most radius / 4,
            where a = b.

    >>> from magshell import shapes
    >>> shapes.smooth_union(shapes.ball(1.0), shapes.ball(1.0), radius=0.4)([2, 0, 0]).item()
    0.9
    """
    return SmoothUnion(several("smooth_union", shapes), positive("radius", "m", radius))
