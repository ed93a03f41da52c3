"""Primitive shapes, each with its exact signed distance."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.scalars import positive
from .shape import Bounds, Shape

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_ORIGIN = (0.0, 0.0, 0.0)


class Primitive(Shape):
    """A shape with a signed distance in closed form, (n, 3) m -> (n,) m.

    low, high: (3,) m, the bounding box of the points where it is negative. text: its repr.
    """

    def __init__(self, distance: Callable[..., Any], low: Numbers, high: Numbers, text: str):
        self._function, self._bounds, self._text = distance, (np.asarray(low), np.asarray(high)), text

    @property
    def bounds(self) -> Bounds:
        low, high = self._bounds
        return low.copy(), high.copy()

    def _distance(self, points: np.ndarray) -> np.ndarray:
        return self._function(points)

    def __repr__(self) -> str:
        return self._text


def ball(radius: float, center: Numbers = _ORIGIN) -> Shape:
    """Return a ball; radius and center (3,) in m.

    >>> ball(1.0)([3, 0, 0]).item()
    2.0
    """
    radius, center = positive("radius", "m", radius), quantity("center", "m", center, (3,))

    def distance(points):
        return np.linalg.norm(points - center, axis=1) - radius

    return Primitive(distance, center - radius, center + radius, f"ball({radius:g})")


def capsule(start: Numbers, end: Numbers, radius: float, end_radius: float | None = None) -> Shape:
    """Return a capsule: the points within a distance `radius` of a segment.

    Args:
        start, end: (3,), m, the ends of the segment; the half balls at the ends reach beyond them.
        radius: m.
        end_radius: m, the radius at `end` of a tapered capsule; by default `radius`.

    >>> capsule((0, 0, 0), (0, 0, 5), radius=1.0)([2, 0, 3]).item()
    1.0
    """
    start, end = quantity("start", "m", start, (3,)), quantity("end", "m", end, (3,))
    radius = positive("radius", "m", radius)
    end_radius = radius if end_radius is None else positive("end_radius", "m", end_radius)
    length = float(np.linalg.norm(end - start))
    if length <= abs(radius - end_radius):
        raise ValueError(
            f"start and end are {length:.6g} m apart, so that one of the end's balls holds the other: take ball(...)"
        )
    axis = (end - start) / length
    slope = (radius - end_radius) / length  # the sine of half the cone's angle
    rise = np.sqrt(1 - slope**2)

    def distance(points):
        from_start = points - start
        along = from_start @ axis
        across = np.linalg.norm(from_start - along[:, None] * axis, axis=1)
        # the nearest point of the segment seen at a right angle to the cone
        foot = np.clip(along - across * slope / rise, 0, length)
        return np.hypot(along - foot, across) - (radius - slope * foot)

    low = np.minimum(start - radius, end - end_radius)
    high = np.maximum(start + radius, end + end_radius)
    taper = "" if end_radius == radius else f", end_radius={end_radius:g}"
    return Primitive(distance, low, high, f"capsule({_listed(start)}, {_listed(end)}, {radius:g}{taper})")


def box(size: Numbers, center: Numbers = _ORIGIN, rounding: float = 0.0) -> Shape:
    """Return a box with sides along the axes.

    Args:
        size: (3,), m, the lengths of its sides.
        center: (3,), m.
        rounding: m, the radius of its edges and corners, at most half the shortest side.

    >>> box((2, 2, 2))([3, 0, 0]).item()
    2.0
    """
    half = 0.5 * quantity("size", "m", size, (3,))
    center = quantity("center", "m", center, (3,))
    rounding = float(quantity("rounding", "m", rounding, ()))
    if not (half > 0).all():
        raise ValueError(f"size [m] must be positive, got {(2 * half).tolist()}")
    if not 0 <= rounding <= half.min():
        raise ValueError(
            f"rounding [m] must lie between 0 and half the shortest side, {half.min():g}, got {rounding:g}"
        )

    def distance(points):
        beyond = np.abs(points - center) - (half - rounding)
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        return outside + np.minimum(beyond.max(axis=1), 0) - rounding

    return Primitive(distance, center - half, center + half, f"box({_listed(2 * half)})")


def cylinder(start: Numbers, end: Numbers, radius: float) -> Shape:
    """Return a circular cylinder with flat ends at `start` and `end` (3,) m.

    >>> cylinder((0, 0, 0), (0, 0, 5), radius=1.0)([0, 0, 6]).item()
    1.0
    """
    start, end = quantity("start", "m", start, (3,)), quantity("end", "m", end, (3,))
    radius = positive("radius", "m", radius)
    length = float(np.linalg.norm(end - start))
    if length == 0:
        raise ValueError("start and end [m] must be two different points")
    axis = (end - start) / length

    def distance(points):
        from_start = points - start
        along = from_start @ axis
        across = np.linalg.norm(from_start - along[:, None] * axis, axis=1)
        beyond = np.stack([across - radius, np.abs(along - 0.5 * length) - 0.5 * length], axis=1)
        return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)

    reach = radius * np.sqrt(np.maximum(1 - axis**2, 0))
    low, high = np.minimum(start, end) - reach, np.maximum(start, end) + reach
    return Primitive(distance, low, high, f"cylinder({_listed(start)}, {_listed(end)}, {radius:g})")


def half_space(normal: Numbers, point: Numbers = _ORIGIN) -> Shape:
    """Return the half-space behind the plane through `point` (3,) m: all x with normal . (x - point) < 0.

    >>> half_space((0, 0, 2))([0, 0, 3]).item()
    3.0
    """
    normal, point = quantity("normal", "1", normal, (3,)), quantity("point", "m", point, (3,))
    length = float(np.linalg.norm(normal))
    if length == 0:
        raise ValueError("normal must not be zero")
    normal = normal / length
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for axis in np.flatnonzero(np.abs(normal) == 1):
        (high if normal[axis] > 0 else low)[axis] = point[axis]
    return Primitive(lambda points: (points - point) @ normal, low, high, f"half_space({_listed(normal)})")


def ellipsoid(radii: Numbers, center: Numbers = _ORIGIN) -> Shape:
    """Return an ellipsoid with axes along x, y and z; radii and center (3,) in m.

    >>> round(ellipsoid((3, 2, 1))([0, 0, 4]).item(), 9)
    3.0
    """
    radii, center = quantity("radii", "m", radii, (3,)), quantity("center", "m", center, (3,))
    if not (radii > 0).all():
        raise ValueError(f"radii [m] must be positive, got {radii.tolist()}")

    def distance(points):
        return _to_ellipsoid(np.abs(points - center), radii)

    return Primitive(distance, center - radii, center + radii, f"ellipsoid({_listed(radii)})")


def _to_ellipsoid(points: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return the signed distances (n,) of points (n, 3) in the first octant from an ellipsoid at the origin, m.

    The nearest point of the surface to p is r^2 p / (r^2 + t), where t is the largest root of sum (r p / (r^2 + t))^2 = 1.
    To the left of this root the sum is convex and decreasing, so Newton's iterates from there increase monotonically.
    """
    largest = radii.max()
    squares = (radii / largest) ** 2
    least = squares.min()
    more = squares - least
    # The point nearest to an inner point on a plane of symmetry may lie off that plane: the lower bound moves the inner
    # point off the plane by a negligible distance.
    p = np.maximum(points / largest, 1e-12 * np.sqrt(squares))
    weighted = p * np.sqrt(squares)
    # u = t + the smallest square: so r^2 + t keeps its digits where it is small
    u = (weighted - more).max(axis=1)
    for _ in range(60):
        inverse = 1 / (more + u[:, None])
        terms = (weighted * inverse) ** 2
        value = terms.sum(axis=1) - 1
        # Newton's method for 1 / sqrt(sum) = 1, which is nearly linear in u
        step = value * (1 + value) / (np.sqrt(1 + value) + 1) / (terms * inverse).sum(axis=1)
        u = u + step
        if (np.abs(step) <= 1e-15 * u).all():
            break
    foot = squares * p / (more + u[:, None])
    t = u - least
    return largest * np.sign(t) * np.linalg.norm(p - foot, axis=1)


def _listed(point: np.ndarray) -> str:
    return f"({', '.join(f'{x:g}' for x in point)})"
