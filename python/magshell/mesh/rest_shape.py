"""Other rest positions of a mesh, and derivatives of what follows from them: areas, lengths, directions across edges.

With the gradients g_k of the shape functions of a triangle and its unit normal n

    dA = A sum_k g_k . dX_k        dn = - sum_k g_k (n . dX_k)        g_k = n x t_k / (2 A)

where t_k is the edge opposite corner k.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._input.quantity import quantity
from .triangles.triangle_mesh import TriangleMesh

# Cosine [-] of the angle between the normals of neighbouring faces below which they lie folded onto each other, and the
# smallest height of a face, over its longest edge [-]. Fixed by test_rest_positions_that_degenerate_name_the_faces.
_FOLDED, _FLATTEST = -0.99, 1e-4
_NAMED = 5  # faces in a message


def moved_mesh(mesh: TriangleMesh, rest_positions: Any) -> TriangleMesh:
    """Return a mesh with the same faces at other rest positions (n_v, 3) m.

    Raises ValueError for another shape, for faces without area, and for neighbours that lie folded onto each other, as
    where a vertex has crossed the opposite edge; the message names the faces.
    """
    x = quantity("rest_positions", "m", rest_positions, (mesh.n_vertices, 3))
    corners = x[mesh.faces]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # opposite each corner
    across = np.cross(edges[:, 0], edges[:, 1])
    doubled = np.linalg.norm(across, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    flat = np.flatnonzero(doubled <= _FLATTEST * longest**2)
    if flat.size:
        raise ValueError(
            f"rest_positions [m] leave {_called(flat)} without area: the smallest has {0.5 * doubled[flat].min():.3g} m2"
        )
    inner = mesh.edge_faces[mesh.interior_edges]
    cosines = [
        np.einsum("ij,ij->i", normals[inner[:, 0]], normals[inner[:, 1]])
        for normals in (across / doubled[:, None], mesh.face_normals)
    ]
    folded = np.unique(inner[(cosines[0] < _FOLDED) & (cosines[1] >= _FOLDED)])
    if folded.size:
        raise ValueError(
            f"rest_positions [m] fold {_called(folded)} onto each other: a vertex has crossed an edge, or the sheet is "
            "folded flat there"
        )
    return mesh._with_rest_positions(x)


def _called(faces: np.ndarray) -> str:
    more = f" and {len(faces) - _NAMED} more" if len(faces) > _NAMED else ""
    return f"face{'s' * (len(faces) > 1)} {', '.join(map(str, faces[:_NAMED]))}{more}"


def shape_gradients(mesh: TriangleMesh, faces: np.ndarray) -> np.ndarray:
    """Return the gradients of the shape functions of some faces (k,) at rest, (k, 3, 3) 1/m: one row per corner."""
    corners = mesh.rest_positions[mesh.faces[faces]]
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    return np.cross(mesh.face_normals[faces][:, None], opposite) / (
        2.0 * mesh.face_areas[faces][:, None, None]
    )


def by_areas(mesh: TriangleMesh, faces: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient by the rest positions, (n_v, 3), from that by the areas of some faces (k,)."""
    of_areas = (gradient * mesh.face_areas[faces])[:, None, None]
    return _summed(mesh, mesh.faces[faces], of_areas * shape_gradients(mesh, faces))


def by_magnetizations(mesh: TriangleMesh, magnetization: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient by the rest positions, (n_v, 3), of magnetic forces, from that by magnetizations, (n_f, 3).

    magnetization: (n_f, 3) A/m. A magnetization M = R c stretches with its face, whose edges and normal at rest are the
    columns a_1, a_2, n of R. The forces are proportional to A and linear in c, so that for the gradient b by M

        b . dM = A b . M dA - b . dR c
    """
    every = np.arange(mesh.n_faces)
    corners = mesh.rest_positions[mesh.faces]
    frames = np.stack(
        [corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], mesh.face_normals], axis=2
    )
    coordinates = np.linalg.solve(frames, magnetization[..., None])[..., 0]
    slopes = shape_gradients(mesh, every)
    rows = (gradient * magnetization).sum(axis=1)[:, None, None] * slopes
    tilts = coordinates[:, 2, None] * np.einsum("fki,fi->fk", slopes, gradient)
    rows = rows + tilts[..., None] * mesh.face_normals[:, None]
    by_edges = -coordinates[:, :2, None] * gradient[:, None]
    rows = rows + np.concatenate([-by_edges.sum(axis=1, keepdims=True), by_edges], axis=1)
    return _summed(mesh, mesh.faces, rows)


def by_edge_vectors(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient by the rest positions, (n_v, 3), from those by the vectors along some edges, (k, 3)."""
    return _summed(mesh, mesh.edges[edges], np.stack([-gradient, gradient], axis=1))


def by_lengths(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient by the rest positions, (n_v, 3), from that by the lengths of some edges (k,)."""
    ends = mesh.rest_positions[mesh.edges[edges]]
    along = ends[:, 1] - ends[:, 0]
    unit = along / np.linalg.norm(along, axis=1, keepdims=True)
    return by_edge_vectors(mesh, edges, gradient[:, None] * unit)


def by_continuations(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient by the rest positions, (n_v, 3), from that by `continuations(mesh, edges)`, (k, 3).

    These are t x n, with the unit vector t along the edge as its first face runs it, and the normal n of that face.
    """
    first = mesh.edge_faces[edges, 0] >= 0
    faces = np.where(first, mesh.edge_faces[edges, 0], mesh.edge_faces[edges, 1])
    ends = mesh.rest_positions[mesh.edges[edges]]
    along = np.where(first[:, None], ends[:, 1] - ends[:, 0], ends[:, 0] - ends[:, 1])
    length = np.linalg.norm(along, axis=1, keepdims=True)
    unit, normal = along / length, mesh.face_normals[faces]
    by_unit, by_normal = np.cross(normal, gradient), np.cross(gradient, unit)
    by_along = (by_unit - unit * (unit * by_unit).sum(axis=1, keepdims=True)) / length
    found = by_edge_vectors(mesh, edges, np.where(first[:, None], by_along, -by_along))
    slopes = np.einsum("fki,fi->fk", shape_gradients(mesh, faces), by_normal)
    return found + _summed(mesh, mesh.faces[faces], -slopes[..., None] * normal[:, None])


def _summed(mesh: TriangleMesh, vertices: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sum rows (k, m, 3) on vertices (k, m) to those on all vertices, (n_v, 3)."""
    total = np.zeros((mesh.n_vertices, 3))
    np.add.at(total, vertices, rows)
    return total
