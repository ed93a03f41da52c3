"""Fans of a triangle mesh: the faces around a vertex that follow each other across edges."""

from __future__ import annotations

import numpy as np

from ..connected import connected_groups
from ..groups import Members, members, row_numbers
from .triangle_mesh import TriangleMesh


def opened(mesh: TriangleMesh, corner_vertex: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """Return the mesh with other vertices at the corners of its faces, and the old number of each vertex.

    corner_vertex: of `corner_vertices`. Faces keep their numbers. Both sides of an opened edge belong to its groups.
    """
    origin = np.empty(corner_vertex.max() + 1, dtype=np.int64)
    origin[corner_vertex] = mesh.faces.ravel()
    made = TriangleMesh(mesh.rest_positions[origin], corner_vertex.reshape(-1, 3))
    return made._with_members(_groups(mesh, made, origin)), origin


def corner_vertices(mesh: TriangleMesh, joining: np.ndarray) -> np.ndarray:
    """Return the vertex of each face corner, (3 n_f,), where faces are joined across some interior edges only.

    joining: indices of the edges. Each fan has a vertex of its own: the first one at a vertex keeps its number, the others
    are appended at the end.
    """
    pairs = np.concatenate(corners_at(mesh, joining))
    fan = connected_groups(3 * mesh.n_faces, pairs)

    _, first_corner, fan = np.unique(fan, return_index=True, return_inverse=True)
    origin = mesh.faces.ravel()[first_corner]
    order = np.lexsort((first_corner, origin))
    is_first = np.concatenate([[True], np.diff(origin[order]) > 0])
    number = np.empty(len(order), dtype=np.int64)
    number[order[is_first]] = origin[order[is_first]]
    number[order[~is_first]] = mesh.n_vertices + np.arange(np.count_nonzero(~is_first))
    return number[fan.ravel()]


def corners_at(mesh: TriangleMesh, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the face corners, 3 face + i, at the lower and at the higher vertex of interior edges, (n, 2) each.

    The two columns are the two faces of an edge.
    """
    lows, highs = [], []
    for side, (at_low, at_high) in enumerate(((1, 2), (2, 1))):  # edge i runs from vertex i + 1 to i + 2
        face = mesh.edge_faces[edges, side].astype(np.int64)
        opposite = np.argmax(mesh.face_edges[face] == edges[:, None], axis=1)
        lows.append(3 * face + (opposite + at_low) % 3)
        highs.append(3 * face + (opposite + at_high) % 3)
    return np.stack(lows, axis=1), np.stack(highs, axis=1)


def _groups(mesh: TriangleMesh, made: TriangleMesh, origin: np.ndarray) -> dict[str, Members]:
    """Return the groups of a mesh that was opened: both sides of an edge belong to the groups of edges and vertices."""
    groups = {}
    for name, group in mesh._groups.items():
        edges = np.isin(mesh.face_edges, row_numbers(mesh.edges, group.edges))
        groups[name] = members(
            np.flatnonzero(np.isin(origin, group.vertices)),
            made.edges[np.unique(made.face_edges[edges])],
            made.faces[row_numbers(mesh.faces, group.faces)],
        )
    return groups
