"""Triangles divided into four by the middles of their edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..signed_distance import Distance, middles_on_surface

if TYPE_CHECKING:
    from .triangle_mesh import TriangleMesh

# local nodes: 0 to 2 corners, 3 to 5 the middles of the edges opposite them
_CHILDREN = np.array([(0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5)])


def refined(mesh: TriangleMesh, surface: Distance | None) -> TriangleMesh:
    """The mesh of the children, those of face f at 4 f; vertices keep their numbers, edge k gets vertex n_v + k."""
    middles = mesh.edge_midpoints
    if surface is not None:
        edges, on_it = middles_on_surface(mesh, np.arange(mesh.n_edges), surface)
        middles = middles.copy()
        middles[edges] = on_it
    nodes = np.concatenate([mesh.faces, mesh.n_vertices + mesh.face_edges], axis=1)
    return type(mesh)(np.concatenate([mesh.rest_positions, middles]), nodes[:, _CHILDREN].reshape(-1, 3))
