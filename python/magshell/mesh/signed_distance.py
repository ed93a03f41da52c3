"""Signed distances that a caller hands in: negative inside, zero on the surface, metres."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .mesh_base import MeshBase

Distance = Callable[[np.ndarray], np.ndarray]

_STEP = 1e-5  # of differences, relative to the length that the caller names
_ROUNDS = 20
_ON_SURFACE = 1e-3  # of an edge: both its ends lie this near to the surface that its middle moves onto


def checked_distance(name: str, function: Distance) -> Distance:
    """The function, which then raises ValueError where it does not return a finite number for each point."""
    if not callable(function):
        raise ValueError(
            f"{name} must be a signed distance, (n, 3) m -> (n,) m, as those of ms.shapes, got {type(function).__name__}"
        )

    def distance(points: np.ndarray) -> np.ndarray:
        values = np.asarray(function(points))
        if values.shape != (len(points),) or values.dtype.kind not in "iuf":
            raise ValueError(
                f"{name} must return {len(points)} distances [m] for {len(points)} points, got shape {values.shape}, "
                f"dtype {values.dtype}"
            )
        if not np.isfinite(values).all():
            k = int(np.argmin(np.isfinite(values)))
            where = ", ".join(f"{x:.6g}" for x in points[k])
            raise ValueError(f"{name} must be finite, but at ({where}) m it is {values[k]}")
        return values.astype(np.float64)

    return distance


def zeros_between(
    distance: Distance, inside: np.ndarray, outside: np.ndarray, at_ends: np.ndarray
) -> np.ndarray:
    """(n,): the fraction of the way from `inside` (n, 3) to `outside` where the distance is zero, to round-off nearly.

    at_ends: (n, 2), the distances there, of opposite sign. The false position is kept from creeping by halving the value
    at the end that stays (the Illinois rule).
    """
    low, high = np.zeros(len(inside)), np.ones(len(inside))
    f_low, f_high = at_ends.T.copy()
    found = np.full(len(inside), 0.5)
    active = np.arange(len(inside))
    last = np.zeros(len(inside), dtype=int)
    for _ in range(_ROUNDS):
        if len(active) == 0:
            break
        a, b = low[active], high[active]
        t = a + (b - a) * f_low[active] / (f_low[active] - f_high[active])
        f = distance(inside[active] + t[:, None] * (outside[active] - inside[active]))
        found[active] = t
        negative = f < 0
        again = np.where(negative, last[active] == -1, last[active] == 1)
        f_high[active] = np.where(negative, np.where(again, 0.5, 1.0) * f_high[active], f)
        f_low[active] = np.where(negative, f, np.where(again, 0.5, 1.0) * f_low[active])
        low[active], high[active] = np.where(negative, t, a), np.where(negative, b, t)
        last[active] = np.where(negative, -1, 1)
        scale = np.abs(at_ends[active]).sum(axis=1)
        active = active[(np.abs(f) > 1e-12 * scale) & (high[active] - low[active] > 1e-12)]
    return found


def onto_surface(distance: Distance, points: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Points (n, 3) moved onto the surface along the gradient; those that do not get there within a quarter of their
    length (n,) [m] stay."""
    moved = points.copy()
    steps = _STEP * lengths
    for _ in range(8):
        value = distance(moved)
        gradient = np.empty_like(moved)
        for axis in range(3):
            shift = np.zeros((len(moved), 3))
            shift[:, axis] = steps
            gradient[:, axis] = (distance(moved + shift) - distance(moved - shift)) / (2 * steps)
        square = np.maximum((gradient**2).sum(axis=1), 1e-6)
        moved -= (value / square)[:, None] * gradient
    arrived = np.abs(distance(moved)) <= 1e-6 * lengths
    near = np.linalg.norm(moved - points, axis=1) <= 0.25 * lengths
    return np.where((arrived & near)[:, None], moved, points)


def middles_on_surface(mesh: MeshBase, edges: np.ndarray, surface: Distance) -> tuple[np.ndarray, np.ndarray]:
    """Those of the edges (k,) whose ends both lie on the surface, and where their middles are once moved onto it."""
    distance = checked_distance("surface", surface)
    lengths = mesh.edge_lengths[edges]
    at_ends = np.abs(distance(mesh.rest_positions))[mesh.edges[edges]]
    on_it = (at_ends <= _ON_SURFACE * lengths[:, None]).all(axis=1)
    return edges[on_it], onto_surface(distance, mesh.edge_midpoints[edges[on_it]], lengths[on_it])
