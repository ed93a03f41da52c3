"""Balls and capsules that rigid bodies carry, and the obstacles that they can touch as smooth shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from .obstacles import Attached, Box, Capsule, Ellipsoid, MeshObstacle, Obstacle, Plane, Sphere
from .obstacles._motion import matrix

# [-] of the radius: a capsule's ends are thinner by half of it where it touches boxes and capsules, so that the place of
# contact moves continuously with the tilt.
CROWN = 1e-3


class RoundPair(NamedTuple):
    """A ball or a capsule, and an obstacle that it can touch at one place.

    middle, half: of the axis in the shape's own frame, (3,) m; half is zero for a ball and for the end of a capsule.
    radius, crown: m.
    """

    shape: Attached
    obstacle: Obstacle
    middle: np.ndarray
    half: np.ndarray
    radius: float
    crown: float


class Gap(NamedTuple):
    """The nearest places of a shape and an obstacle in one state: distance m, normal (3,) from the obstacle, and the
    point (3,) m on the shape."""

    distance: float
    normal: np.ndarray
    point: np.ndarray


def shapes_in(contacts: Iterable[Any]) -> tuple[Attached, ...]:
    """Return the shapes of contacts, each once."""
    every = [shape for contact in contacts for shape in getattr(contact, "shapes", ())]
    return tuple({id(each): each for each in every}.values())


def checked_shapes(shapes: Sequence[Obstacle]) -> tuple[Attached, ...]:
    """Return the shapes of a contact. Raises ValueError if one is not a solid ball or capsule that a body carries."""
    for each in shapes:
        of = each.obstacle if isinstance(each, Attached) else None
        if not isinstance(of, Sphere | Capsule) or of.inside:
            raise ValueError(
                "shapes must be solid spheres and capsules that rigid bodies carry, "
                f"ms.obstacles.Attached(ms.obstacles.Sphere(...), to=body), got {each!r:.80}"
            )
    return tuple(shapes)  # pyright: ignore[reportReturnType]


def round_pairs(shapes: Sequence[Attached], obstacles: Iterable[Obstacle]) -> tuple[RoundPair, ...]:
    """Return what can touch, each pair once, but for shapes and obstacles of one rigid body.

    Raises ValueError for an obstacle that a shape cannot touch smoothly.
    """
    pairs: list[RoundPair] = []
    seen: set[frozenset[int]] = set()
    obstacles = tuple(obstacles)
    for shape in sorted(shapes, key=lambda each: isinstance(each.obstacle, Capsule)):  # balls touch exactly
        for obstacle in obstacles:
            both = frozenset((id(shape), id(obstacle)))
            same = isinstance(obstacle, Attached) and obstacle.to is shape.to
            if not same and both not in seen:
                seen.add(both)
                pairs += _pairs(shape, obstacle)
    return tuple(pairs)


def _pairs(shape: Attached, obstacle: Obstacle) -> list[RoundPair]:
    """Return the places where a shape and an obstacle can touch."""
    of = obstacle.obstacle if isinstance(obstacle, Attached) else obstacle
    hollow = getattr(of, "inside", False)
    if isinstance(of, MeshObstacle) or (isinstance(of, Box) and hollow):
        what = "a MeshObstacle" if isinstance(of, MeshObstacle) else "a hollow Box"
        raise ValueError(
            f"smooth shapes touch at one place, but {what} can touch at several: use Planes, or contact of the "
            f"vertices of a RigidBody's shape, got {obstacle!r:.80}"
        )
    if isinstance(shape.obstacle, Sphere):
        return [RoundPair(shape, obstacle, np.zeros(3), np.zeros(3), shape.obstacle.radius, 0.0)]
    capsule: Any = shape.obstacle
    middle, half, radius = capsule.ends.mean(axis=0), 0.5 * np.diff(capsule.ends, axis=0)[0], capsule.radius
    if isinstance(of, Plane) or (hollow and isinstance(of, Sphere | Ellipsoid | Capsule)):
        return [RoundPair(shape, obstacle, end, np.zeros(3), radius, 0.0) for end in capsule.ends]
    if not isinstance(of, Sphere | Ellipsoid | Capsule | Box):
        raise ValueError(
            "a capsule that a body carries can touch Plane, Sphere, Ellipsoid, Capsule and Box, got "
            f"{obstacle!r:.80}: put spheres along its axis instead"
        )
    crown = CROWN * radius if isinstance(of, Capsule | Box) else 0.0
    return [RoundPair(shape, obstacle, middle, half, radius, crown)]


def gap(pair: RoundPair, shape: Obstacle, obstacle: Obstacle, time: float) -> Gap:
    """Return the nearest places of a pair; shape, obstacle: as they are in the state."""
    rotation = matrix(shape.rotation)
    middle, half = shape.center + rotation @ pair.middle, rotation @ pair.half
    place = (
        _nearest(lambda t: obstacle.normals(middle + t * half, time) @ half + pair.crown * t)
        if half.any()
        else 0.0
    )
    at = middle + place * half
    normal = obstacle.normals(at, time)
    distance = float(obstacle.signed_distance(at, time)) + 0.5 * pair.crown * place**2 - pair.radius
    return Gap(distance, normal, at - pair.radius * normal)


def _nearest(slope: Callable[[float], float]) -> float:
    """Return the place from -1 to 1 along an axis where a convex function with this slope is least."""
    if slope(-1.0) >= 0.0:
        return -1.0
    if slope(1.0) <= 0.0:
        return 1.0
    return float(scipy.optimize.brentq(slope, -1.0, 1.0, xtol=1e-15))
