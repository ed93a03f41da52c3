"""Shapes of several."""

from __future__ import annotations

from ..._input.scalars import positive
from .shape import Difference, Intersection, Shape, SmoothUnion, Union, several


def union(*shapes: Shape) -> Shape:
    """All that lies in one of them, `a | b`.

    >>> import magshell as ms
    >>> two = ms.shapes.union(ms.shapes.ball(0.01), ms.shapes.ball(0.01, center=(0.03, 0, 0)))
    >>> bool(two([(0.03, 0, 0)])[0] < 0)
    True
    """
    return Union(several("union", shapes))


def intersection(*shapes: Shape) -> Shape:
    """All that lies in each of them, `a & b`.

    >>> import magshell as ms
    >>> lens = ms.shapes.intersection(ms.shapes.ball(0.01), ms.shapes.ball(0.01, center=(0.01, 0, 0)))
    >>> bool(lens([(0.015, 0, 0)])[0] > 0)
    True
    """
    return Intersection(several("intersection", shapes))


def difference(shape: Shape, *others: Shape) -> Shape:
    """What others leave of a shape, `a - b`.

    >>> import magshell as ms
    >>> bowl = ms.shapes.difference(ms.shapes.ball(0.01), ms.shapes.ball(0.008))
    >>> bool(bowl([(0, 0, 0)])[0] > 0)
    True
    """
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
