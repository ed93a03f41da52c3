"""Tetrahedra divided into smaller ones.

Bey's division into eight: four at the corners, four around the inner diagonal from the middle of edge 02 to that of 13.
The numbering of the children, whose corners 0 and 2 may change places to turn them, makes no new shapes after the
second division.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .tet_jacobian import shape_values, straight_volumes
from .tet_order import quadratic, ten_nodes
from .tet_topology import EDGES, MIRRORED, edge_table

if TYPE_CHECKING:
    from .tet_mesh import TetMesh
    from .tet_order import Projection

# local nodes: 0 to 3 corners, 4 to 9 the middles of 01 12 20 03 13 23
_CHILDREN = np.array(
    [
        (0, 4, 6, 7),
        (4, 1, 5, 8),
        (6, 5, 2, 9),
        (7, 8, 9, 3),
        (4, 6, 7, 8),
        (4, 6, 5, 8),
        (6, 7, 8, 9),
        (6, 5, 8, 9),
    ]
)
_BARYCENTRIC = np.concatenate([np.eye(4), 0.5 * (np.eye(4)[EDGES[:, 0]] + np.eye(4)[EDGES[:, 1]])])


def _turned(children: np.ndarray) -> np.ndarray:
    """The same with positive volumes."""
    corners = _BARYCENTRIC[children][:, :, 1:]
    inverted = straight_volumes(corners) < 0
    return np.where(inverted[:, None], children[:, MIRRORED[:4]], children)


CHILDREN = _turned(_CHILDREN)


def refined(mesh: TetMesh, surface: Projection | None = None) -> TetMesh:
    parts = np.repeat(mesh.parts, 8)
    if mesh.order == 1:
        nodes = ten_nodes(mesh)
        positions = np.concatenate([mesh.rest_positions, mesh.edge_midpoints])
        if surface is not None:
            positions = quadratic(mesh, surface).rest_positions
        return type(mesh)(positions, nodes[:, CHILDREN].reshape(-1, 4), parts, mesh.part_names)

    corners = mesh.tetrahedra[:, CHILDREN].reshape(-1, 4)
    table = edge_table(corners)
    # the curved edges' middles are where the parent's map takes them, the same from each side but for round-off
    middles = 0.5 * (_BARYCENTRIC[CHILDREN[:, EDGES[:, 0]]] + _BARYCENTRIC[CHILDREN[:, EDGES[:, 1]]])
    values = shape_values(middles.reshape(-1, 4)).reshape(8, 6, 10)
    on_edges = np.einsum("cen,tni->tcei", values, mesh.rest_positions[mesh.tetrahedra]).reshape(-1, 3)
    first = np.unique(table.tetrahedron_edges.ravel(), return_index=True)[1]
    positions = np.concatenate([mesh.rest_positions, on_edges[first]])
    nodes = np.concatenate([corners, mesh.n_vertices + table.tetrahedron_edges], axis=1)
    fine = type(mesh)(positions, nodes, parts, mesh.part_names)
    return fine if surface is None else quadratic(fine.first_order(), surface)
