"""Cuts of a triangle mesh along its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.arrays import index_array
from ..._runtime.solver_entry_point import grouped
from ..triangles.fans import corner_vertices, corners_at, opened
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

    corner_vertex = corner_vertices(mesh, np.setdiff1d(mesh.interior_edges, edges))
    lows, highs = corners_at(mesh, edges)
    low_joined, high_joined = (corner_vertex[c[:, 0]] == corner_vertex[c[:, 1]] for c in (lows, highs))
    closed = edges[low_joined & high_joined]
    if len(closed):
        raise ValueError(
            f"a cut along edge {closed[0]} alone does not open, because both its ends stay joined; "
            "cut at least two edges in a row, or refine the mesh"
        )
    return opened(mesh, corner_vertex)[0]
