"""Signed distance functions given by a caller: negative inside, zero on the surface, in metres."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .mesh_base import MeshBase

Distance = Callable[[np.ndarray], np.ndarray]

_STEP = 1e-5  # [-] step of finite differences, relative to the caller's `lengths`
_ROUNDS = 20
# [-] Largest distance of an edge's ends from the surface, relative to its length, for its midpoint to be moved onto it.
_ON_SURFACE = 1e-3


def checked_distance(name: str, function: Distance) -> Distance:
    """Return the function with a check: it raises ValueError if it does not return one finite number for each point.

    name: what the messages call it.
    """
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
    """Find the zero of the distance on each segment from `inside` (n, 3) to `outside`, as a fraction of its length, (n,).

    at_ends: (n, 2) m, the distances at the two points, of opposite sign. The method is regula falsi in the Illinois variant:
    the value at an end point that does not move is halved. The result is accurate nearly to round-off.
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
    """Return the points (n, 3) m moved along the gradient of the distance onto the surface.

    A point that does not arrive, or only by moving more than a quarter of its entry of `lengths` (n,) [m], stays.
    """
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
    """Return those of the edges (k,) whose ends lie on the surface, (n,), and their midpoints moved onto it, (n, 3) m."""
    distance = checked_distance("surface", surface)
    lengths = mesh.edge_lengths[edges]
    at_ends = np.abs(distance(mesh.rest_positions))[mesh.edges[edges]]
    on_it = (at_ends <= _ON_SURFACE * lengths[:, None]).all(axis=1)
    return edges[on_it], onto_surface(distance, mesh.edge_midpoints[edges[on_it]], lengths[on_it])
