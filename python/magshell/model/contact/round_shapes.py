"""Smooth shapes that rigid bodies carry, and the obstacles that they can touch: balls, capsules, ellipsoids and the
corners of boxes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ... import _core
from .obstacles import Attached, Box, Capsule, Ellipsoid, MeshObstacle, Obstacle, Plane, Sphere
from .obstacles._motion import matrix

# The shapes that a body can carry. Of two that touch, the one whose kind is first here is `shape` of the pair.
_KINDS = (Sphere, Capsule, Ellipsoid, Box)
# [-] of the radius: a capsule's ends are thinner by half of it where it touches boxes and capsules, so that the place of
# contact moves continuously with the tilt.
CROWN = 1e-3


class RoundPair(NamedTuple):
    """A shape, or an end or a corner of one, and an obstacle that it can touch at one place.

    The shape consists of all points within this radius of its core: middle + half t in its own frame, with |t| <= 1.
    half has no columns for a ball, one for a capsule and three for an ellipsoid, whose radius is zero.

    middle: (3,) m. half: (3, 0), (3, 1) or (3, 3) m. radius, crown: m. least, most: m, half the smallest and the largest
    width of the shape across.
    """

    shape: Attached
    obstacle: Obstacle
    middle: np.ndarray
    half: np.ndarray
    radius: float
    crown: float
    least: float
    most: float

    @property
    def core(self) -> _core.ShapeCore:
        return _core.ShapeCore(self.middle, self.half, self.radius, self.crown)


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
    """Return the shapes of a contact. Raises ValueError if one is not a solid of `_KINDS` that a body carries."""
    for each in shapes:
        of = each.obstacle if isinstance(each, Attached) else None
        if not isinstance(of, _KINDS) or of.inside:
            raise ValueError(
                "shapes must be solid spheres, capsules, ellipsoids and boxes that rigid bodies carry, "
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
    for shape in sorted(shapes, key=lambda each: _KINDS.index(type(each.obstacle))):
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
    solid = shape.obstacle
    if isinstance(solid, Sphere):
        return [_ball(shape, obstacle, np.zeros(3), solid.radius)]
    touches_by_ends = isinstance(of, Plane) or (hollow and isinstance(of, Sphere | Ellipsoid | Capsule))
    if isinstance(solid, Capsule) and touches_by_ends:
        return [_ball(shape, obstacle, end, solid.radius) for end in solid.ends]
    if isinstance(solid, Box) and touches_by_ends:
        half = 0.5 * solid.size
        inner = [(-x, x) for x in half - solid.rounding]
        return [
            _ball(shape, obstacle, np.array(corner), solid.rounding)._replace(
                least=float(half.min()), most=float(half.max())
            )
            for corner in product(*inner)
        ]
    _refuse_pair(solid, of, hollow, obstacle)
    if isinstance(solid, Ellipsoid):
        axes = solid.semi_axes
        return [
            RoundPair(
                shape, obstacle, np.zeros(3), np.diag(axes), 0.0, 0.0, float(axes.min()), float(axes.max())
            )
        ]
    capsule: Any = solid
    middle, half, radius = capsule.ends.mean(axis=0), 0.5 * np.diff(capsule.ends, axis=0).T, capsule.radius
    crown = CROWN * radius if isinstance(of, Capsule | Box) else 0.0
    return [RoundPair(shape, obstacle, middle, half, radius, crown, radius, radius)]


def _ball(shape: Attached, obstacle: Obstacle, center: np.ndarray, radius: float) -> RoundPair:
    return RoundPair(shape, obstacle, center, np.zeros((3, 0)), radius, 0.0, radius, radius)


def _refuse_pair(solid: Obstacle, of: Obstacle, hollow: bool, obstacle: Obstacle) -> None:
    """Raise ValueError for a capsule, an ellipsoid or a box that cannot touch an obstacle at one place."""
    if isinstance(solid, Capsule) and not isinstance(of, Sphere | Ellipsoid | Capsule | Box):
        raise ValueError(
            "a capsule that a body carries can touch Plane, Sphere, Ellipsoid, Capsule and Box, got "
            f"{obstacle!r:.80}: put spheres along its axis instead"
        )
    if isinstance(solid, Ellipsoid) and (
        hollow or not isinstance(of, Plane | Sphere | Ellipsoid | Capsule | Box)
    ):
        raise ValueError(
            "an ellipsoid that a body carries can touch Plane, and solid Sphere, Ellipsoid, Capsule and Box, got "
            f"{obstacle!r:.80}"
        )
    if isinstance(solid, Ellipsoid) and isinstance(of, Box) and of.rounding == 0.0:
        raise ValueError(
            f"an ellipsoid cannot touch sharp edges smoothly: give the Box a rounding, got {obstacle!r:.80}"
        )
    if isinstance(solid, Box):
        raise ValueError(
            "a box that a body carries can touch Plane and hollow Sphere, Ellipsoid and Capsule with its corners, and "
            f"spheres, capsules and ellipsoids that are shapes as well, got {obstacle!r:.80}: use contact of the "
            "vertices of a RigidBody's shape"
        )


def gap(pair: RoundPair, shape: Obstacle, obstacle: Obstacle, time: float) -> Gap:
    """Return the nearest places of a pair; shape, obstacle: as they are in the state."""
    axes, origin = obstacle._frame(time)
    distance, normal, point = _core.nearest_point(
        obstacle._core, pair.core, axes.T @ (shape.center - origin), axes.T @ matrix(shape.rotation)
    )
    return Gap(distance, axes @ normal, origin + axes @ point)
