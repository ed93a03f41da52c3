"""Cuts of a triangle mesh along its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._input.arrays import index_array
from ..._runtime.solver_entry_point import grouped
from ..groups import Members, members, row_numbers
from ..triangles.triangle_mesh import TriangleMesh, checked_mesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@grouped()
def cut(mesh: TriangleMesh, edges: Numbers) -> TriangleMesh:
    """Cut a mesh along interior edges, so that the two sides of the cut get separate vertices.

    The ends of a cut stay joined unless they lie on the boundary or on another cut, so a slit needs at least
    two edges to open. Faces keep their numbers. Vertices on one side of the cut keep their numbers, those on the other side
    are appended at the end.

    Args:
        mesh: the mesh to cut; it is not changed.
        edges: indices of interior edges.

    Raises:
        ValueError: for an edge that is out of range, on the boundary, or does not open.

    >>> import magshell as ms
    >>> sheet = ms.meshes.rectangle(4.0, 2.0, cells=(4, 2))
    >>> slit = sheet.edges_where(lambda p: (p[:, 1] == 1.0) & (abs(p[:, 0] - 2.0) < 1.0))
    >>> len(ms.meshes.cut(sheet, slit).boundary_loops)
    2
    """
    checked_mesh(mesh)
    edges = np.unique(index_array("edges", edges))
    outside = edges[(edges < 0) | (edges >= mesh.n_edges)]
    if len(outside):
        raise ValueError(f"edges names edge {outside[0]}, but they are numbered 0 to {mesh.n_edges - 1}")
    on_boundary = np.intersect1d(edges, mesh.boundary_edges)
    if len(on_boundary):
        raise ValueError(f"edge {on_boundary[0]} is on the boundary: there is nothing to cut")

    corner_vertex = _corner_vertices(mesh, np.setdiff1d(mesh.interior_edges, edges))
    lows, highs = _corners_at(mesh, edges)
    low_joined, high_joined = (corner_vertex[c[:, 0]] == corner_vertex[c[:, 1]] for c in (lows, highs))
    closed = edges[low_joined & high_joined]
    if len(closed):
        raise ValueError(
            f"a cut along edge {closed[0]} alone does not open, because both its ends stay joined; "
            "cut at least two edges in a row, or refine the mesh"
        )
    origin = np.empty(corner_vertex.max() + 1, dtype=np.int64)
    origin[corner_vertex] = mesh.faces.ravel()
    opened = TriangleMesh(mesh.rest_positions[origin], corner_vertex.reshape(-1, 3))
    return opened._with_members(_groups(mesh, opened, origin))


def _groups(mesh: TriangleMesh, opened: TriangleMesh, origin: np.ndarray) -> dict[str, Members]:
    """Return the groups of the cut mesh: both sides of a cut belong to the groups of its edges and vertices."""
    groups = {}
    for name, group in mesh._groups.items():
        edges = np.isin(mesh.face_edges, row_numbers(mesh.edges, group.edges))
        groups[name] = members(
            np.flatnonzero(np.isin(origin, group.vertices)),
            opened.edges[np.unique(opened.face_edges[edges])],
            opened.faces[row_numbers(mesh.faces, group.faces)],
        )
    return groups


def _corners_at(mesh: TriangleMesh, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def _corner_vertices(mesh: TriangleMesh, uncut: np.ndarray) -> np.ndarray:
    """Return the new vertex at each face corner, (3 n_f,); corners stay joined across uncut edges."""
    pairs = np.concatenate(_corners_at(mesh, uncut))
    n_corners = 3 * mesh.n_faces
    graph = scipy.sparse.coo_array(
        (np.ones(len(pairs), dtype=bool), tuple(pairs.T)), shape=(n_corners, n_corners)
    )
    fan = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]

    _, first_corner, fan = np.unique(fan, return_index=True, return_inverse=True)
    origin = mesh.faces.ravel()[first_corner]
    order = np.lexsort((first_corner, origin))
    is_first = np.concatenate([[True], np.diff(origin[order]) > 0])
    number = np.empty(len(order), dtype=np.int64)
    number[order[is_first]] = origin[order[is_first]]
    number[order[~is_first]] = mesh.n_vertices + np.arange(np.count_nonzero(~is_first))
    return number[fan.ravel()]
