"""Refinement of tetrahedral meshes, and conversion between four and ten nodes."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from ..groups import renumbered
from ..off_surface import warn_of_nodes_off
from ..signed_distance import Distance, middles_on_surface
from ..topology import EDGES, MIRRORED, edge_table
from .jacobian import jacobians, not_positive, shape_values, straight_volumes

if TYPE_CHECKING:
    from .tet_mesh import TetMesh


Projection = Distance
_LEAST_JACOBIAN = 0.1  # [-] smallest Jacobian determinant, relative to that of the straight tetrahedron


def quadratic(mesh: TetMesh, surface: Projection | None) -> TetMesh:
    """Return the mesh with ten nodes, with the midside nodes on the boundary moved onto a surface if one is given."""
    nodes = ten_nodes(mesh)
    mesh._warn_of_new_vertices()
    positions = np.concatenate([mesh.rest_positions, mesh.edge_midpoints])
    if surface is None:
        return type(mesh)(positions, nodes, mesh.parts, mesh.part_names)._with_members(mesh._groups)
    edges, middles = middles_on_surface(mesh, mesh.boundary_edges, surface)
    target = positions.copy()
    target[mesh.n_vertices + edges] = middles
    positions = limit_displacements(positions, target, nodes)
    warn_of_nodes_off(mesh, edges, positions[mesh.n_vertices + edges], surface)
    return type(mesh)(positions, nodes, mesh.parts, mesh.part_names)._with_members(mesh._groups)


def curved(mesh: TetMesh, project: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> TetMesh:
    """Return the mesh with ten nodes, with the midside nodes at project(midpoints (n_e, 3), edges (n_e, 2)), (n_e, 3) m.

    A node moves only part of the way if its tetrahedra would keep less than a tenth of their Jacobian determinant.
    """
    nodes = ten_nodes(mesh)
    straight = np.concatenate([mesh.rest_positions, mesh.edge_midpoints])
    target = np.concatenate([mesh.rest_positions, project(mesh.edge_midpoints, mesh.edges)])
    curved_mesh = type(mesh)(limit_displacements(straight, target, nodes), nodes, mesh.parts, mesh.part_names)
    return curved_mesh._with_members(mesh._groups)


def ten_nodes(mesh: TetMesh) -> np.ndarray:
    """Return the ten nodes of each tetrahedron, (n_t, 10), with node n_v + k on edge k."""
    return np.concatenate([mesh.tetrahedra, mesh.n_vertices + mesh.tetrahedron_edges], axis=1)


def limit_displacements(straight: np.ndarray, target: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Return the nodes moved from `straight` (n_v, 3) to `target`, or only part of the way.

    The displacement of the nodes of a tetrahedron, `nodes` (n_t, 10), is halved up to four times, then set to zero, as long
    as its Jacobian determinant is below a tenth of that of the straight tetrahedron.
    """
    fraction = np.ones(len(straight))
    floor = _LEAST_JACOBIAN * 6 * straight_volumes(straight[nodes[:, :4]])
    checked = np.flatnonzero((straight != target).any(axis=1)[nodes].any(axis=1))
    for halving in count():  # this ends, because tetrahedra whose nodes do not move are valid
        positions = straight + fraction[:, None] * (target - straight)
        bad = checked[not_positive(jacobians(positions[nodes[checked]]), floor[checked])]
        if len(bad) == 0:
            return positions
        fraction[np.unique(nodes[bad])] *= 0.5 if halving < 4 else 0.0


def linear(mesh: TetMesh) -> TetMesh:
    """Return the mesh of the corners only, with four-node tetrahedra."""
    used = np.unique(mesh.corners)
    numbers = np.full(mesh.n_vertices, -1)
    numbers[used] = np.arange(len(used))
    straight = type(mesh)(mesh.rest_positions[used], numbers[mesh.corners], mesh.parts, mesh.part_names)
    return straight._with_members(renumbered(mesh._groups, numbers))


# nodes of a tetrahedron: 0 to 3 are its corners, 4 to 9 the midpoints of the edges 01 12 20 03 13 23
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
BARYCENTRIC = np.concatenate([np.eye(4), 0.5 * (np.eye(4)[EDGES[:, 0]] + np.eye(4)[EDGES[:, 1]])])


def _oriented(children: np.ndarray) -> np.ndarray:
    """Return the same tetrahedra (8, 4) with their nodes reordered where needed, so that all volumes are positive."""
    corners = BARYCENTRIC[children][:, :, 1:]
    inverted = straight_volumes(corners) < 0
    return np.where(inverted[:, None], children[:, MIRRORED[:4]], children)


CHILDREN = _oriented(_CHILDREN)


def refined(mesh: TetMesh, surface: Projection | None = None) -> TetMesh:
    """Return the mesh with each tetrahedron divided into eight; see `TetMesh.refined`."""
    parts = np.repeat(mesh.parts, 8)
    if mesh.order == 1:
        nodes = ten_nodes(mesh)
        positions = np.concatenate([mesh.rest_positions, mesh.edge_midpoints])
        if surface is not None:
            positions = quadratic(mesh._with_members({}), surface).rest_positions
        fine = type(mesh)(positions, nodes[:, CHILDREN].reshape(-1, 4), parts, mesh.part_names)
        return fine._with_members(mesh._refined_groups())

    corners = mesh.tetrahedra[:, CHILDREN].reshape(-1, 4)
    table = edge_table(corners)
    # the new midside nodes lie on the curved parent; its neighbours give the same positions up to round-off
    middles = 0.5 * (BARYCENTRIC[CHILDREN[:, EDGES[:, 0]]] + BARYCENTRIC[CHILDREN[:, EDGES[:, 1]]])
    values = shape_values(middles.reshape(-1, 4)).reshape(8, 6, 10)
    on_edges = np.einsum("cen,tni->tcei", values, mesh.rest_positions[mesh.tetrahedra]).reshape(-1, 3)
    first = np.unique(table.tetrahedron_edges.ravel(), return_index=True)[1]
    positions = np.concatenate([mesh.rest_positions, on_edges[first]])
    nodes = np.concatenate([corners, mesh.n_vertices + table.tetrahedron_edges], axis=1)
    fine = type(mesh)(positions, nodes, parts, mesh.part_names)._with_members(mesh._refined_groups())
    return fine if surface is None else quadratic(fine.first_order(), surface)
