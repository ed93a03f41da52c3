"""Sheets of six-node elements from those of three nodes, curved where the surface is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..mesh.six_node_mesh import SixNodeMesh
from ..mesh.triangle_mesh import TriangleMesh


def sheet_of_order(
    mesh: TriangleMesh, order: int, place: Callable[[np.ndarray], np.ndarray] | None = None
) -> TriangleMesh | SixNodeMesh:
    """The mesh with elements of this order. place: (n, 3) m -> (n, 3) m, from middles of edges onto the surface."""
    if isinstance(order, bool) or order not in (1, 2):
        raise ValueError(f"order must be 1 (three nodes) or 2 (six nodes), got {order!r:.60}")
    return mesh if order == 1 else SixNodeMesh.of(mesh, place)


def round_sheet(mesh: TriangleMesh, order: int, axes: tuple[int, ...]) -> TriangleMesh | SixNodeMesh:
    """Likewise, with nodes on edges at the mean of their ends' distances from the origin of the given axes: an edge on a
    circle around it, or on a sphere, is an arc of it."""
    across = list(axes)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)[mesh.edges].mean(axis=1)

    def place(middles: np.ndarray) -> np.ndarray:
        there = np.linalg.norm(middles[:, across], axis=1)
        middles[:, across] *= np.divide(radii, there, out=np.ones_like(radii), where=there > 1e-9 * radii)[
            :, None
        ]
        return middles

    return sheet_of_order(mesh, order, place)
