"""Refuses vertices that are the corners of quadratic elements without the nodes between them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .triangles.six_node_mesh import QuadraticTriangleMesh
from .triangles.triangle_mesh import TriangleMesh


def refuse_corners_alone(name: str, mesh: Any, vertices: np.ndarray) -> None:
    """Raise ValueError if an object holds corners of quadratic elements, but none of the nodes between them.

    So it is with vertices that were selected on a mesh of the same elements without middle nodes, which would silently
    stay free. name: of the object's class.
    """
    if isinstance(mesh, QuadraticTriangleMesh):
        _refuse_ends_alone(name, mesh, vertices)
    elif not isinstance(mesh, TriangleMesh) and mesh.order > 1:
        _refuse_corners_of_faces_alone(name, mesh, vertices)


def _refuse_corners_of_faces_alone(name: str, mesh: Any, vertices: np.ndarray) -> None:
    """Raise ValueError if all corners of a face of a quadratic solid are held, but none of its middle nodes."""
    held = np.zeros(mesh.n_vertices, dtype=bool)
    held[vertices] = True
    middles = mesh.faces[3::4]  # of the four triangles of a face, the one between its middle nodes
    corners = held[mesh.faces_of_corners].all(axis=1) & ~held[middles].any(axis=1)
    if corners.any():
        raise ValueError(
            f"{name} vertices hold the corners of {np.count_nonzero(corners)} faces of a quadratic Solid, and none of the "
            "nodes between them: select on the mesh of the solid, as in solid.mesh.vertices_at(x=0.0), which has "
            "ten nodes a tetrahedron"
        )


def _refuse_ends_alone(name: str, mesh: QuadraticTriangleMesh, vertices: np.ndarray) -> None:
    """Raise ValueError if a row of edges of six-node elements is held by its ends, but none of the nodes between them."""
    held = np.zeros(mesh.n_vertices, dtype=bool)
    held[vertices] = True
    edges = mesh.edges[held[mesh.edges].all(axis=1)]
    in_a_row = len(edges) and np.bincount(edges.ravel()).max() > 1
    if in_a_row and not held[mesh.edge_nodes].any():
        raise ValueError(
            f"{name} vertices hold the ends of {len(edges)} edges of six-node elements, and none of the nodes between them: "
            "select on the mesh of the shell, as in shell.mesh.vertices_at(x=0.0)"
        )
