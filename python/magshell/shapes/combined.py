"""Shapes of several."""

from __future__ import annotations

from .._checks.scalars import positive
from .shape import Difference, Intersection, Shape, SmoothUnion, Union, several


def union(*shapes: Shape) -> Shape:
    """All that lies in one of them, `a | b`."""
    return Union(several("union", shapes))


def intersection(*shapes: Shape) -> Shape:
    """All that lies in each of them, `a & b`."""
    return Intersection(several("intersection", shapes))


def difference(shape: Shape, *others: Shape) -> Shape:
    """What others leave of a shape, `a - b`."""
    return Difference(several("difference", (shape, *others)))


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
    return SmoothUnion(several("smooth_union", shapes), positive("radius", "m", radius))
