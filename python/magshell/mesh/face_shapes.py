"""Distribution of face and edge loads to the nodes of a mesh, by the shape functions of its elements.

A six-node triangle, or one side of a ten-node tetrahedron, appears in `mesh.faces` as four flat triangles. A load on one of
these triangles acts on all six nodes of the element.
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
    """Return the nodes of each element side, (n, 3) or (n, 6), and the number of the mesh's faces per side, 1 or 4.

    Face f of the mesh is part f % parts of side f // parts.
    """
    if isinstance(mesh, QuadraticTriangleMesh):
        return mesh.elements, len(FLAT)
    if isinstance(mesh, TetMesh) and mesh.order == 2:
        return mesh.nodes_of_sides, len(FLAT)
    return mesh.faces, 1


def corner_axes(corners: np.ndarray) -> np.ndarray:
    """Return two orthonormal vectors in the plane of each triangle, (n, 2, 3): along its first edge, and to the left of it.

    corners: (n, 3, 3) m.
    """
    edges = corners[:, 1:] - corners[:, :1]
    first = edges[:, 0] / np.linalg.norm(edges[:, 0], axis=1, keepdims=True)
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def nodal_areas(
    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices that carry a load on faces (k,), and the area that each of them stands for.

    Returns vertices, (k, 3) or (k, 6), and the integrals of their shape functions over the reference area of the face, m2,
    of the same shape.
    """
    nodes, parts = sides(mesh)
    if parts == 1:
        return nodes[faces], np.repeat(mesh.face_areas[faces, None] / 3.0, 3, axis=1)
    nodes = nodes[faces // parts]
    weights = np.empty(nodes.shape)
    for part, corners in enumerate(FLAT):
        here = faces % parts == part
        weights[here] = shape_integrals(mesh.rest_positions[nodes[here]], corners)
    return nodes, weights


def nodal_lengths(
    mesh: TriangleMesh | QuadraticTriangleMesh | TetMesh, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices that carry a load on edges (k,), and the length that each of them stands for.

    Returns vertices, (k, 2) or (k, 3), and the integrals of their shape functions along the edge in the reference
    configuration, m, of the same shape.
    """
    if not isinstance(mesh, QuadraticTriangleMesh):
        return mesh.edges[edges], np.repeat(mesh.edge_lengths[edges, None] / 2.0, 2, axis=1)
    nodes = mesh.nodes_of_edges[edges]
    return nodes, edge_integrals(mesh.rest_positions[nodes])
