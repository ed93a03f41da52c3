"""Fibre directions in a solid: along a line, as a function of the position, or from arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.scalars import positive
from ..._input.selections import indices, selection
from ..._runtime.frozen import immutable
from ...mesh.tetrahedra.tet_mesh import TetMesh
from .solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_BACK = -0.98  # [-] smallest cosine between successive pieces of a line; below, it turns back on itself
_LEAST = 1e-3  # [-] smallest weight of a tetrahedron that gets fibres, which is exp(-6.9): 6.9 times the reach away


@immutable
@dataclass(frozen=True)
class Fibres:
    """Fibres of some of a solid's tetrahedra, found by ms.fibres_along or made by hand.

    elements: the tetrahedra, each once, (k,), or a mask of all tetrahedra, of which k are True. directions: (k, 3), in the
        reference configuration, of any length except zero.
    weights: (k,), factors of a muscle's strength in the tetrahedra, 1 by default.
    coordinates: (k,) m, of each tetrahedron along its fibre, or None.
    length: m, of the fibres, by default the range of the coordinates.

    >>> import magshell as ms
    >>> ms.Fibres(elements=[0, 1], directions=[(1, 0, 0), (1, 0, 0)]).elements
    array([0, 1])
    """

    elements: np.ndarray = field(repr=False)
    directions: np.ndarray = field(repr=False)
    weights: np.ndarray | None = field(repr=False, default=None)
    coordinates: np.ndarray | None = field(repr=False, default=None)
    length: float | None = None

    def __post_init__(self) -> None:
        elements = selection("elements", self.elements, "tetrahedra")
        count = len(elements) if elements.dtype != bool else int(elements.sum())
        directions = quantity("directions", "", self.directions, (count, 3))
        weights = np.ones(count) if self.weights is None else self.weights
        weights = checked_weights(weights, count)
        checked_directions("directions", directions, (count, 3))
        object.__setattr__(self, "elements", elements)
        object.__setattr__(self, "directions", directions)
        object.__setattr__(self, "weights", weights)
        length = None if self.length is None else positive("length", "m", self.length)
        if self.coordinates is not None:
            coordinates = quantity("coordinates", "m", self.coordinates, (count,))
            object.__setattr__(self, "coordinates", coordinates)
            length = length or float(np.ptp(coordinates)) or None
        object.__setattr__(self, "length", length)

    def __repr__(self) -> str:
        length = "" if self.length is None else f", {self.length:.4g} m long"
        return f"Fibres(in {len(self.directions)} tetrahedra{length})"


def checked_directions(name: str, values: Any, shape: tuple[Any, ...]) -> np.ndarray:
    """Return vectors of any length except zero. Raises ValueError."""
    array = quantity(name, "", values, shape)
    short = ~(np.linalg.norm(np.atleast_2d(array), axis=1) > 0)
    if short.any():
        raise ValueError(f"{name} must not be zero, but that of row {int(np.argmax(short))} is")
    return array


def checked_weights(values: Any, count: int) -> np.ndarray:
    """Return weights (count,), from an array or one number; none may be negative, and not all zero.

    Raises ValueError.
    """
    shape = shape_of("weights", values)
    array = np.broadcast_to(quantity("weights", "1", values, () if shape == () else (count,)), (count,))
    if (array < 0).any():
        index = int(np.argmax(array < 0))
        raise ValueError(f"weights must not be negative, but weights[{index}] is {array[index]:g}")
    if not array.any():
        raise ValueError("weights must not all be zero")
    return array


def fibres_along(
    line: Numbers, body: Solid | TetMesh, *, reach: Numbers, elements: Numbers | None = None
) -> Fibres:
    """Find fibres along a line through a solid.

    Each tetrahedron near the line gets the line's direction at the nearest point, the weight exp(-distance/reach), and
    its coordinate along the line; the distance is that of its center.

    line: (n, 3) m, the corners of a polyline, n > 1. Its direction is interpolated between the midpoints of its pieces,
        so that fibres have no kinks.
    body: Solid or TetMesh. reach: m.
    elements: the tetrahedra that may get fibres, by default all; those with a weight of 0.001 or more get them.

    Raises ValueError if the line misses these tetrahedra, if none has such a weight, and if the line turns back on itself.

    >>> import magshell as ms
    >>> mesh = ms.meshes.box((0.1, 0.02, 0.02), cells=(10, 2, 2))
    >>> ms.fibres_along([(0, 0.01, 0.02), (0.1, 0.01, 0.02)], mesh, reach=0.002)
    Fibres(in 140 tetrahedra, 0.1 m long)
    """
    line = quantity("line", "m", line, ("n", 3))
    pieces = np.diff(line, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    if len(line) < 2 or not (lengths > 0).all():
        what = f"corner {int(np.argmin(lengths))} is there twice" if len(line) > 1 else f"got {len(line)}"
        raise ValueError(f"line [m] must have two corners or more, none twice in a row: {what}")
    reach = positive("reach", "m", reach)
    mesh = body.mesh if isinstance(body, Solid) else body
    if not isinstance(mesh, TetMesh):
        raise ValueError(f"body must be a Solid or a TetMesh, got {type(body).__name__}")
    points = mesh.tetrahedron_barycenters
    chosen = np.arange(len(points))
    if elements is not None:
        chosen = indices("elements", selection("elements", elements, "tetrahedra"), len(points))
    distances, coordinates = _nearest(points[chosen], line, pieces, lengths)
    weights = np.exp(-distances / reach)
    if not (distances <= _sizes(mesh)[chosen]).any():
        raise ValueError(
            f"the line misses the solid: the nearest of its tetrahedra is {distances.min():.4g} m away"
        )
    near = weights >= _LEAST
    if not near.any():
        raise ValueError(
            f"no tetrahedron is within reach of the line: the nearest middle is {distances.min():.4g} m away, "
            f"reach [m] is {reach:g}"
        )
    length = float(lengths.sum())
    return Fibres(
        chosen[near],
        _tangents(coordinates[near], pieces, lengths),
        weights[near],
        coordinates[near],
        length,
    )


def _nearest(points, line, pieces, lengths) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of each point (n, 3) from the line, and the coordinate of the nearest point along the line, m."""
    best = np.full(len(points), np.inf)
    where = np.zeros(len(points))
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    for k, (piece, length) in enumerate(zip(pieces, lengths, strict=True)):
        fraction = np.clip((points - line[k]) @ piece / length**2, 0.0, 1.0)
        distance = np.linalg.norm(points - line[k] - fraction[:, None] * piece, axis=1)
        nearer = distance < best
        best[nearer] = distance[nearer]
        where[nearer] = starts[k] + fraction[nearer] * length
    return best, where


def _tangents(coordinates, pieces, lengths) -> np.ndarray:
    """Return unit vectors at coordinates along the line, interpolated between the midpoints of its pieces."""
    middles = np.cumsum(lengths) - 0.5 * lengths
    units = pieces / lengths[:, None]
    if (turned := np.sum(units[1:] * units[:-1], axis=1) < _BACK).any():
        corner = int(np.argmax(turned)) + 1
        raise ValueError(f"line turns back on itself at corner {corner}: give it more corners there")
    rows = np.stack([np.interp(coordinates, middles, units[:, axis]) for axis in range(3)], axis=1)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _sizes(mesh: TetMesh) -> np.ndarray:
    """Return the distance of the farthest corner of each tetrahedron from its center, (n_t,) m."""
    corners = mesh.rest_positions[mesh.tetrahedra[:, :4]]
    return np.linalg.norm(corners - mesh.tetrahedron_barycenters[:, None], axis=2).max(axis=1)


def fibres_of(
    fibres: Fibres | Numbers | Callable[[np.ndarray], Numbers], mesh: TetMesh, elements: Numbers
) -> Fibres:
    """Return the `fibres` argument of a Muscle as Fibres. Raises ValueError.

    It may be Fibres, one vector, one per tetrahedron of `elements`, or a function of their centers (k, 3) m.
    """
    n = mesh.n_tetrahedra
    if isinstance(fibres, Fibres):
        if elements is not None:
            raise ValueError("elements of a Muscle are those of its Fibres: give them there")
        indices("elements of Fibres", fibres.elements, n)
        return fibres
    chosen = np.arange(n)
    if elements is not None:
        chosen = indices("elements", selection("elements", elements, "tetrahedra"), n)
    if callable(fibres):
        fibres = fibres(mesh.tetrahedron_barycenters[chosen])
    shape = shape_of("fibres", fibres)
    if shape not in ((3,), (len(chosen), 3)):
        raise ValueError(
            f"fibres must be Fibres, a vector (3,), one a tetrahedron, (k, 3) = ({len(chosen)}, 3), or a function of the "
            f"place (k, 3) m that returns such, got shape {shape}"
        )
    rows = np.broadcast_to(checked_directions("fibres", fibres, shape), (len(chosen), 3))
    return Fibres(chosen, rows)
