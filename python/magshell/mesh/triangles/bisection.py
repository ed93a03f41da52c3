"""Local refinement of triangle meshes by halving edges, the longest edge of each divided face among them (Rivara 1984)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .triangle_mesh import TriangleMesh


def bisected_edges(mesh: TriangleMesh, marked: np.ndarray) -> np.ndarray:
    """Return the edges to be divided so that the marked faces, (k,), are divided and the mesh stays conforming, ascending.

    They are all edges of marked faces, and the longest edge of every face that has another divided edge.
    """
    face_edges = mesh.face_edges
    longest = face_edges[np.arange(mesh.n_faces), longest_sides(mesh)]
    split_edges = np.zeros(mesh.n_edges, dtype=bool)
    split_edges[face_edges[marked]] = True
    while True:
        reached = longest[split_edges[face_edges].any(axis=1)]
        if split_edges[reached].all():
            return np.flatnonzero(split_edges)
        split_edges[reached] = True


def longest_sides(mesh: TriangleMesh) -> np.ndarray:
    """Return the corner opposite the longest edge of each face, (n_f,); of equally long edges that with the largest number.

    The order of edges makes the choice the same in both faces of an edge, so that the chain of longest edges ends.
    """
    lengths = mesh.edge_lengths[mesh.face_edges]
    near = lengths >= (1.0 - 1e-9) * lengths.max(axis=1, keepdims=True)
    return np.where(near, mesh.face_edges, -1).argmax(axis=1)


def divided_faces(mesh: TriangleMesh, split_edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces (m, 3) of the mesh with these edges divided, and the face that each lies in, (m,).

    The middle of the k-th of these edges is vertex n_v + k. Faces keep their orientation; the parts of a face follow
    each other.
    """
    middle = np.full(mesh.n_edges, -1)
    middle[split_edges] = mesh.n_vertices + np.arange(len(split_edges))
    turn = (longest_sides(mesh)[:, None] + np.arange(3)) % 3  # the corner opposite the longest edge first
    rows = np.arange(mesh.n_faces)[:, None]
    a, b, c = mesh.faces[rows, turn].T.astype(np.int64)
    of_a, of_b, of_c = middle[mesh.face_edges[rows, turn]].T
    whole = of_a < 0
    number = np.arange(mesh.n_faces)
    at_b, at_c = ~whole & (of_b >= 0), ~whole & (of_c >= 0)
    parts = [
        (whole, (a, b, c)),
        (~whole & ~at_c, (a, b, of_a)),
        (at_c, (of_a, a, of_c)),
        (at_c, (of_a, of_c, b)),
        (~whole & ~at_b, (a, of_a, c)),
        (at_b, (of_a, c, of_b)),
        (at_b, (of_a, of_b, a)),
    ]
    faces = np.concatenate([np.stack(corners, axis=1)[here] for here, corners in parts])
    parents = np.concatenate([number[here] for here, _ in parts])
    order = np.argsort(parents, kind="stable")
    return faces[order].astype(np.int32), parents[order]
