"""Six-node triangle meshes made from three-node ones, with curved edges on curved surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..triangles.six_node_mesh import QuadraticTriangleMesh
from ..triangles.triangle_mesh import TriangleMesh


def check_order(order) -> None:
    """Raise ValueError unless the order is 1 or 2."""
    if isinstance(order, bool) or order not in (1, 2):
        raise ValueError(f"order must be 1 (three nodes) or 2 (six nodes), got {order!r:.60}")


def sheet_of_order(
    mesh: TriangleMesh, order: int, project: Callable[[np.ndarray], np.ndarray] | None = None
) -> TriangleMesh | Any:
    """Return the mesh with elements of the given order, 1 or 2.

    project: maps the midpoints of edges onto the surface, (n, 3) m -> (n, 3) m.
    """
    check_order(order)
    return mesh if order == 1 else QuadraticTriangleMesh.from_triangles(mesh, project)


def round_sheet(mesh: TriangleMesh, order: int, axes: tuple[int, ...]) -> TriangleMesh | Any:
    """Return a mesh of a round surface with elements of the given order, 1 or 2, with arcs as edges.

    The distance of a midside node from the origin, measured in the coordinates `axes`, is the mean of the distances of the
    edge's ends. So an edge on a cylinder or a sphere around the origin becomes an arc. If the mesh is flat and lies in the
    plane of two axes, only edges on its boundary are curved: inside, straight edges are exact, and curved ones would distort
    the elements, most of all near the center.
    """
    across = list(axes)
    flat = not np.delete(mesh.rest_positions, across, axis=1).any() and len(axes) == 2
    bent = mesh.boundary_edges if flat else np.arange(mesh.n_edges)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)[mesh.edges].mean(axis=1)

    def project(middles: np.ndarray) -> np.ndarray:
        current = np.linalg.norm(middles[:, across], axis=1)
        factors = np.divide(radii, current, out=np.ones_like(radii), where=current > 1e-9 * radii)
        middles[np.ix_(bent, across)] *= factors[bent, None]
        return middles

    return sheet_of_order(mesh, order, project)
