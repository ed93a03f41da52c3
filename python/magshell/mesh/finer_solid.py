"""Finer meshes of the same solid: of second order, or divided into eight, and how they descend from the coarse mesh."""

from __future__ import annotations

import numpy as np

from .finer import FinerMesh, interpolation_rows
from .tetrahedra.jacobian import shape_values
from .tetrahedra.refine import BARYCENTRIC, CHILDREN
from .tetrahedra.tet_mesh import TetMesh
from .topology import EDGES, FACES


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
    # Barycentric coordinates in the parent of the middle of each edge of each child, for the first child that has it.
    first = np.unique(fine.tetrahedron_edges.ravel(), return_index=True)[1]
    middles = 0.5 * (BARYCENTRIC[CHILDREN[:, EDGES[:, 0]]] + BARYCENTRIC[CHILDREN[:, EDGES[:, 1]]])
    middle = np.tile(middles.reshape(-1, 4), (mesh.n_tetrahedra, 1))[first]
    parent = first // (8 * len(EDGES))
    inside = middle > 0.0
    count = inside.sum(axis=1)
    new_edges, new_sides, new_elements = (np.full(len(first), -1) for _ in range(3))
    for k, ends in enumerate(EDGES):
        here = (count == 2) & inside[:, ends].all(axis=1)
        new_edges[here] = mesh.tetrahedron_edges[parent[here], k]
    on_side = count == 3
    new_sides[on_side] = _outer_side(mesh, 4 * parent[on_side] + (~inside[on_side]).argmax(axis=1))
    new_elements[(new_edges < 0) & (new_sides < 0)] = parent[(new_edges < 0) & (new_sides < 0)]
    weights = interpolation_rows(mesh.n_vertices, mesh.tetrahedra[parent], shape_values(middle))
    child, face = np.divmod(fine._outer, 4)
    corners = BARYCENTRIC[CHILDREN[child % 8][np.arange(len(child))[:, None], FACES[face]]]
    opposite = (
        (corners == 0.0).all(axis=1).argmax(axis=1)
    )  # the parent's corner that its side lies opposite to
    return FinerMesh(
        mesh,
        fine,
        element_parents=np.repeat(np.arange(mesh.n_tetrahedra), 8),
        edge_parents=new_edges,
        new_edges=new_edges,
        new_elements=new_elements,
        interpolation=weights,
        new_sides=new_sides,
        side_parents=_outer_side(mesh, 4 * (child // 8) + opposite),
    )


def _outer_side(mesh: TetMesh, faces: np.ndarray) -> np.ndarray:
    """Return the number among the outer sides of faces 4 t + i of tetrahedra, -1 for inner ones."""
    place = np.minimum(np.searchsorted(mesh._outer, faces), len(mesh._outer) - 1)
    return np.where(mesh._outer[place] == faces, place, -1)
