"""Finer meshes of the same solid: of second order, divided or bisected, and how they descend from the coarse mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .finer import FinerMesh, children, edge_parents, interpolation_rows
from .groups import members, row_numbers
from .tetrahedra.bisection import bisected_edges, divided_simplices
from .tetrahedra.jacobian import shape_values
from .tetrahedra.refine import BARYCENTRIC, CHILDREN
from .tetrahedra.tet_mesh import TetMesh
from .topology import EDGES, FACES, edge_table

if TYPE_CHECKING:
    from .groups import Members


def finer_solid(mesh: TetMesh) -> FinerMesh:
    """Return the mesh of ten-node tetrahedra on the same four-node ones, or with each ten-node one divided into eight."""
    return _second_order(mesh) if mesh.order == 1 else _divided(mesh)


def _second_order(mesh: TetMesh) -> FinerMesh:
    edges, elsewhere = np.arange(mesh.n_edges), np.full(mesh.n_edges, -1)
    means = interpolation_rows(mesh.n_vertices, mesh.edges, np.full(mesh.edges.shape, 0.5))
    return FinerMesh(
        mesh,
        mesh._with_members({}).second_order(),
        element_parents=np.arange(mesh.n_tetrahedra),
        edge_parents=edges,
        new_edges=edges,
        new_elements=elsewhere,
        interpolation=means,
        new_sides=elsewhere,
        side_parents=np.arange(len(mesh.faces_of_corners)),
    )


def _divided(mesh: TetMesh) -> FinerMesh:
    """Return the mesh divided into eight; the midside node of each new edge is in the order of the new edges."""
    fine = mesh._with_members({}).refined()
    parents = np.repeat(np.arange(mesh.n_tetrahedra), 8)
    local = np.tile(CHILDREN, (mesh.n_tetrahedra, 1))
    first = np.unique(fine.tetrahedron_edges.ravel(), return_index=True)[1]
    parent, middle = parents[first // 6], _middles(local)[first]
    new_edges, new_sides, new_elements = _vertex_parents(mesh, parent, middle)
    return FinerMesh(
        mesh,
        fine,
        element_parents=parents,
        edge_parents=new_edges,
        new_edges=new_edges,
        new_elements=new_elements,
        interpolation=interpolation_rows(mesh.n_vertices, mesh.tetrahedra[parent], shape_values(middle)),
        new_sides=new_sides,
        side_parents=_side_parents(mesh, fine, parents, local),
    )


def bisected_solid(mesh: TetMesh, marked: np.ndarray) -> FinerMesh:
    """Return the mesh with the marked tetrahedra, (k,), divided into eight, and others so that it stays conforming.

    Edges of marked tetrahedra are divided in the middle. Every other tetrahedron and face with a divided edge is bisected
    across its longest edge first, so that the shapes of faces do not degenerate (Plaza and Carey 2000). Ten-node tetrahedra
    keep their curved shape; midside nodes of divided edges become corners.
    """
    split_edges = bisected_edges(mesh, marked)
    count = len(split_edges)
    new = mesh.n_vertices + np.arange(count) if mesh.order == 1 else mesh.edge_nodes[split_edges]
    ends = mesh.edges[split_edges]
    corners, parents = divided_simplices(mesh.corners, ends, new)
    between = np.full(mesh.n_edges, -1)
    between[split_edges] = new
    ten = np.concatenate([mesh.corners, between[mesh.tetrahedron_edges]], axis=1)[parents]
    local = (ten[:, None, :] == corners[:, :, None]).argmax(axis=2)
    if mesh.order == 1:
        nodes = corners
        new_edges, new_sides = split_edges, np.full(count, -1)
        new_elements = new_sides
        interpolation = interpolation_rows(mesh.n_vertices, ends, np.full(ends.shape, 0.5))
    else:
        table = edge_table(corners)
        whole = row_numbers(mesh.edges, table.edges)
        is_new = whole < 0  # these edges get new midside nodes
        first = np.unique(table.tetrahedron_edges.ravel(), return_index=True)[1][is_new]
        parent, middle = parents[first // 6], _middles(local)[first]
        new_edges, new_sides, new_elements = _vertex_parents(mesh, parent, middle)
        interpolation = interpolation_rows(mesh.n_vertices, mesh.tetrahedra[parent], shape_values(middle))
        middles = np.where(is_new, mesh.n_vertices - 1 + np.cumsum(is_new), mesh.edge_nodes[whole])
        nodes = np.concatenate([corners, middles[table.tetrahedron_edges]], axis=1)
    positions = interpolation @ mesh.rest_positions
    fine = TetMesh(positions, nodes, mesh.parts[parents], mesh.part_names)
    fine = fine._with_members(_groups(mesh, ends, new, parents))
    return FinerMesh(
        mesh,
        fine,
        element_parents=parents,
        edge_parents=edge_parents(mesh, split_edges, between, fine),
        new_edges=new_edges,
        new_elements=new_elements,
        interpolation=interpolation,
        new_sides=new_sides,
        side_parents=_side_parents(mesh, fine, parents, local),
    )


def _middles(local: np.ndarray) -> np.ndarray:
    """Return where the middles of the edges of parts lie in their parents, (6 n, 4) barycentric coordinates.

    local: (n, 4), the corners of each part among the ten nodes of its parent.
    """
    return 0.5 * (BARYCENTRIC[local[:, EDGES[:, 0]]] + BARYCENTRIC[local[:, EDGES[:, 1]]]).reshape(-1, 4)


def _vertex_parents(
    mesh: TetMesh, parent: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the edge, else the outer side, else the tetrahedron that new vertices lie inside, -1 for others, (n,) each.

    parent: (n,), a tetrahedron that each lies in. at: (n, 4), its barycentric coordinates there.
    """
    inside = at > 0.0
    count = inside.sum(axis=1)
    new_edges, new_sides, new_elements = (np.full(len(at), -1) for _ in range(3))
    for k, ends in enumerate(EDGES):
        here = (count == 2) & inside[:, ends].all(axis=1)
        new_edges[here] = mesh.tetrahedron_edges[parent[here], k]
    on_side = count == 3
    new_sides[on_side] = _outer_side(mesh, 4 * parent[on_side] + (~inside[on_side]).argmax(axis=1))
    elsewhere = (new_edges < 0) & (new_sides < 0)
    new_elements[elsewhere] = parent[elsewhere]
    return new_edges, new_sides, new_elements


def _side_parents(mesh: TetMesh, fine: TetMesh, parents: np.ndarray, local: np.ndarray) -> np.ndarray:
    """Return the outer side of the coarse mesh that each outer side of parts lies in; local as in `_middles`."""
    part, face = np.divmod(fine._outer, 4)
    corners = BARYCENTRIC[local[part[:, None], FACES[face]]]
    opposite = (corners == 0.0).all(axis=1).argmax(axis=1)  # the parent's corner opposite its side
    return _outer_side(mesh, 4 * parents[part] + opposite)


def _outer_side(mesh: TetMesh, faces: np.ndarray) -> np.ndarray:
    """Return the number among the outer sides of faces 4 t + i of tetrahedra, -1 for inner ones."""
    place = np.minimum(np.searchsorted(mesh._outer, faces), len(mesh._outer) - 1)
    return np.where(mesh._outer[place] == faces, place, -1)


def _groups(mesh: TetMesh, ends: np.ndarray, new: np.ndarray, parents: np.ndarray) -> dict[str, Members]:
    """Return the groups of the bisected mesh: parts of edges, faces and tetrahedra take the place of these."""
    if mesh._groups:
        mesh._warn_of_new_vertices()
    return {
        name: members(
            group.vertices,
            divided_simplices(group.edges, ends, new)[0],
            divided_simplices(group.faces, ends, new)[0],
            children(parents, group.tetrahedra)[1],
        )
        for name, group in mesh._groups.items()
    }
