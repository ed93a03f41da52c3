"""Sheets of six-node elements from those of three nodes, curved where the surface is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..triangles.six_node_mesh import QuadraticTriangleMesh
from ..triangles.triangle_mesh import TriangleMesh


def check_order(order) -> None:
    """Raises ValueError unless it is 1 or 2."""
    if isinstance(order, bool) or order not in (1, 2):
        raise ValueError(f"order must be 1 (three nodes) or 2 (six nodes), got {order!r:.60}")


def sheet_of_order(
    mesh: TriangleMesh, order: int, place: Callable[[np.ndarray], np.ndarray] | None = None
) -> TriangleMesh | Any:
    """The mesh with elements of this order. place: (n, 3) m -> (n, 3) m, from middles of edges onto the surface."""
    check_order(order)
    return mesh if order == 1 else QuadraticTriangleMesh.of(mesh, place)


def round_sheet(mesh: TriangleMesh, order: int, axes: tuple[int, ...]) -> TriangleMesh | Any:
    """Likewise, with nodes on edges at the mean of their ends' distances from the origin of the given axes: an edge on a
    cylinder around it, or on a sphere, is an arc of it. Of a sheet in the plane of two axes only edges on the border are
    bent: inside, straight ones are exact and bent ones are not, the less the nearer they are to the middle."""
    across = list(axes)
    flat = not np.delete(mesh.rest_positions, across, axis=1).any() and len(axes) == 2
    bent = mesh.boundary_edges if flat else np.arange(mesh.n_edges)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)[mesh.edges].mean(axis=1)

    def place(middles: np.ndarray) -> np.ndarray:
        there = np.linalg.norm(middles[:, across], axis=1)
        factors = np.divide(radii, there, out=np.ones_like(radii), where=there > 1e-9 * radii)
        middles[np.ix_(bent, across)] *= factors[bent, None]
        return middles

    return sheet_of_order(mesh, order, place)
