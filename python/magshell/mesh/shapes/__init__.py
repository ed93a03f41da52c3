"""Shapes described by signed distances, to be combined and then meshed by `ms.meshes.from_distance`.

    hand = palm.smooth_union(thumb, fingers, radius=4e-3) - ms.shapes.ball(5e-3)

A shape is a function of points (n, 3) m that returns distances (n,) m, negative inside. `a | b` is the union, `a & b` the
intersection, `a - b` the difference.
"""

from .primitives import ball, box, capsule, cylinder, ellipsoid, half_space
from .shape import Shape, difference, intersection, smooth_union, union

__all__ = [
    "Shape",
    "ball",
    "box",
    "capsule",
    "cylinder",
    "difference",
    "ellipsoid",
    "half_space",
    "intersection",
    "smooth_union",
    "union",
]


def __dir__() -> list[str]:
    """Return the public names, for tab completion."""
    return sorted(__all__)
