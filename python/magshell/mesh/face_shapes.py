"""Faces and edges of a mesh with the shapes of its elements.

A side of ten-node tetrahedra, and a six-node triangle, is shown as four flat triangles, but what acts on one of them is
shared out over all six nodes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .tetrahedra.tet_mesh import TetMesh
from .topology import FLAT
from .triangles.six_node_checks import edge_integrals, shape_integrals
from .triangles.six_node_mesh import QuadraticTriangleMesh

if TYPE_CHECKING:
    from .triangles.triangle_mesh import TriangleMesh


def sides(mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh) -> tuple[np.ndarray, int]:
    """The nodes of each side, (n, 3) or (n, 6), and how many of the mesh's faces it is: face f is part f % parts of side
    f // parts."""
    if isinstance(mesh, QuadraticTriangleMesh):
        return mesh.elements, len(FLAT)
    if isinstance(mesh, TetMesh) and mesh.order == 2:
        return mesh.nodes_of_sides, len(FLAT)
    return mesh.faces, 1


def corner_axes(corners: np.ndarray) -> np.ndarray:
    """Two unit vectors in the plane of each three corners (n, 3, 3), (n, 2, 3): along the first edge, and to the left."""
    edges = corners[:, 1:] - corners[:, :1]
    first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def shares(
    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whose nodes feel what acts on the area at rest of some faces (k,), and how much of it: (k, 3) or (k, 6) vertices,
    and the integrals of their shape functions over the face, m2, likewise."""
    nodes, parts = sides(mesh)
    if parts == 1:
        return nodes[faces], np.repeat(mesh.face_areas[faces, None] / 3.0, 3, axis=1)
    nodes = nodes[faces // parts]
    weights = np.empty(nodes.shape)
    for part, corners in enumerate(FLAT):
        here = faces % parts == part
        weights[here] = shape_integrals(mesh.rest_positions[nodes[here]], corners)
    return nodes, weights


def edge_shares(
    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Likewise along some edges (k,): (k, 2) or (k, 3) vertices, and m."""
    if not isinstance(mesh, QuadraticTriangleMesh):
        return mesh.edges[edges], np.repeat(mesh.edge_lengths[edges, None] / 2.0, 2, axis=1)
    nodes = mesh.nodes_of_edges[edges]
    return nodes, edge_integrals(mesh.rest_positions[nodes])
