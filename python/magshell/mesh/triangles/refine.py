"""Uniform refinement of triangle meshes: each face is divided into four."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..signed_distance import Distance, middles_on_surface

if TYPE_CHECKING:
    from .triangle_mesh import TriangleMesh

# nodes of a face: 0 to 2 are its corners, 3 to 5 the midpoints of the edges opposite to them
_CHILDREN = np.array([(0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5)])


def refined(mesh: TriangleMesh, surface: Distance | None) -> TriangleMesh:
    """Return the refined mesh, in which face f becomes the faces 4 f to 4 f + 3.

    Vertices keep their numbers, and the midpoint of edge k is vertex n_v + k. surface: a signed distance onto whose zeros
    midpoints are moved, or None.
    """
    middles = mesh.edge_midpoints
    if surface is not None:
        edges, on_it = middles_on_surface(mesh, np.arange(mesh.n_edges), surface)
        middles = middles.copy()
        middles[edges] = on_it
    nodes = np.concatenate([mesh.faces, mesh.n_vertices + mesh.face_edges], axis=1)
    fine = type(mesh)(np.concatenate([mesh.rest_positions, middles]), nodes[:, _CHILDREN].reshape(-1, 3))
    return fine._with_members(mesh._refined_groups())
