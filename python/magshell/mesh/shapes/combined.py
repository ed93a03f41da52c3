"""Boolean combinations of shapes."""

from __future__ import annotations

from ..._input.scalars import positive
from .shape import Difference, Intersection, Shape, SmoothUnion, Union, several


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
