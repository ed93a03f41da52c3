"""Where fibres run in a solid: along a line, as a function of the place, or as arrays have them."""

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

_BACK = -0.98  # the cosine between two pieces beyond which what is between them has no direction
_LEAST = 1e-3  # weights below are left out: the reach times 6.9


@immutable
@dataclass(frozen=True)
class Fibres:
    """Fibres of some of a solid's tetrahedra, as ms.fibres_along finds them, or made by hand.

    elements: (k,), the tetrahedra, each once. directions: (k, 3), at rest, of any length but zero. weights: (k,), how much
    of a muscle is there, 1 by default. coordinates: (k,) m, of each along its fibre, or None; length: m, of the fibres, by
    default as far as the coordinates reach.

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
        return f"Fibres(in {len(self.elements)} tetrahedra{length})"


def checked_directions(name: str, values: Any, shape: tuple[Any, ...]) -> np.ndarray:
    """Vectors of any length but zero."""
    array = quantity(name, "", values, shape)
    short = ~(np.linalg.norm(np.atleast_2d(array), axis=1) > 0)
    if short.any():
        raise ValueError(f"{name} must not be zero, but that of row {int(np.argmax(short))} is")
    return array


def checked_weights(values: Any, count: int) -> np.ndarray:
    """(count,), or one for all; none below zero, some above."""
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
    """Fibres along a line through a solid: each tetrahedron near it has their direction at the nearest point of the line,
    the weight exp(-distance/reach), and its coordinate along the line, from the distance of its middle.

    line: (n, 3) m, the corners of a polyline, n > 1. Its direction turns evenly from the middle of one piece to the middle
        of the next, so that fibres have no kinks.
    body: Solid or TetMesh. reach: m. elements: which tetrahedra may have some, by default all; of these, those with a
        weight of 0.001 and more have.

    Raises ValueError where no tetrahedron does: the line misses the solid.

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
    """Of each point (n, 3): its distance from the line, and where along it the nearest point is, m."""
    best = np.full(len(points), np.inf)
    where = np.zeros(len(points))
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    for k, (piece, length) in enumerate(zip(pieces, lengths, strict=True)):
        share = np.clip((points - line[k]) @ piece / length**2, 0.0, 1.0)
        distance = np.linalg.norm(points - line[k] - share[:, None] * piece, axis=1)
        nearer = distance < best
        best[nearer] = distance[nearer]
        where[nearer] = starts[k] + share[nearer] * length
    return best, where


def _tangents(coordinates, pieces, lengths) -> np.ndarray:
    """Unit vectors, from those in the middles of the pieces."""
    middles = np.cumsum(lengths) - 0.5 * lengths
    units = pieces / lengths[:, None]
    if (turned := np.sum(units[1:] * units[:-1], axis=1) < _BACK).any():
        corner = int(np.argmax(turned)) + 1
        raise ValueError(f"line turns back on itself at corner {corner}: give it more corners there")
    rows = np.stack([np.interp(coordinates, middles, units[:, axis]) for axis in range(3)], axis=1)
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def _sizes(mesh: TetMesh) -> np.ndarray:
    """(n_t,) m: how far the farthest corner of each tetrahedron is from its middle."""
    corners = mesh.rest_positions[mesh.tetrahedra[:, :4]]
    return np.linalg.norm(corners - mesh.tetrahedron_barycenters[:, None], axis=2).max(axis=1)


def fibres_of(
    fibres: Fibres | Numbers | Callable[[np.ndarray], Numbers], mesh: TetMesh, elements: Numbers
) -> Fibres:
    """What a Muscle was given as a Fibres: one, a vector, one a tetrahedron, or a function of the place."""
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
