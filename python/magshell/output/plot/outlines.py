"""The edges of bodies that pictures show as lines from every side: borders and sharp edges."""

from __future__ import annotations

import numpy as np

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State

# [-] Cosine of the angle between the normals of two faces in the reference configuration; an edge with a larger angle is
# drawn as a crease. On closed surfaces the angle is larger, since coarse meshes of round bodies have large angles as well.
CREASE = np.cos(np.radians(40.0))
SOLID_CREASE = np.cos(np.radians(65.0))


def outline(mesh: TriangleMesh) -> np.ndarray:
    """Return the edges to draw as lines from every side, (k, 2): borders, and creases of the rest shape."""
    return mesh.edges[outline_edges(mesh)]


def outline_edges(mesh: TriangleMesh) -> np.ndarray:
    """Return the numbers of the edges of the outline, ascending.

    Creases of a closed surface that end somewhere are left out: on coarse meshes of round bodies they are fragments.
    """
    interior = mesh.interior_edges
    normals = mesh.face_normals[mesh.edge_faces[interior]]
    cosine = np.einsum("ei,ei->e", normals[:, 0], normals[:, 1])
    closed = of_closed(mesh)[interior]
    sharp = interior[closed & (cosine < SOLID_CREASE)]
    creases = interior[~closed & (cosine < CREASE)]
    return np.sort(np.concatenate([mesh.boundary_edges, creases, sharp[_without_ends(mesh.edges[sharp])]]))


def seen(state: State, edges: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return those of the edges (k,) that are not on the far side of a closed surface.

    Lines are lifted towards the eye, so those on the far side would be visible through the surface.
    """
    mesh = state.mesh
    hidden = of_closed(mesh)[edges] & ~towards_eye(state, eye)[mesh.edge_faces[edges]].any(axis=1)
    return edges[~hidden]


def of_closed(mesh: TriangleMesh) -> np.ndarray:
    """Return whether each edge belongs to a connected part without boundary, (n_e,) bool."""
    of_edge = mesh.components[mesh.edges[:, 0]]
    return ~np.isin(of_edge, of_edge[mesh.boundary_edges])


def towards_eye(state: State, eye: np.ndarray) -> np.ndarray:
    """Return whether the outer side of each face is towards the eye, (n_f,) bool; for closed surfaces."""
    mesh = state.mesh
    x0, x1, x2 = np.moveaxis(state.positions[mesh.faces], 1, 0)
    piece = mesh.components[mesh.faces[:, 0]]
    # volumes of the connected parts, negative if normals point inwards
    volumes = np.bincount(piece, np.einsum("fi,fi->f", x0, np.cross(x1, x2)))
    return np.cross(x1 - x0, x2 - x0) @ eye * np.sign(volumes)[piece] > 0


def _without_ends(edges: np.ndarray) -> np.ndarray:
    """Return whether each edge (k, 2) is left after edges with a free end have been removed, again and again, (k,) bool."""
    left = np.ones(len(edges), dtype=bool)
    while True:
        count = np.bincount(edges[left].ravel(), minlength=edges.max(initial=-1) + 1)
        still = left & (count[edges] > 1).all(axis=1)
        if (still == left).all():
            return left
        left = still
