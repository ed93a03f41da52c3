"""Other rest positions of a mesh, and derivatives of what follows from them: areas, lengths, directions across edges.

With the gradients g_k of the shape functions of a triangle and its unit normal n

    dA = A sum_k g_k . dX_k        dn = - sum_k g_k (n . dX_k)        g_k = n x t_k / (2 A)

where t_k is the edge opposite corner k.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._input.quantity import quantity
from .face_shapes import sides
from .tetrahedra.jacobian import by_shape_integrals, jacobians, not_positive, straight_volumes
from .tetrahedra.tet_mesh import TetMesh
from .topology import EDGES, FLAT
from .triangles import six_node_checks
from .triangles.six_node_mesh import QuadraticTriangleMesh
from .triangles.triangle_mesh import TriangleMesh

# Cosine [-] of the angle between the normals of neighbouring faces below which they lie folded onto each other, and the
# smallest height of a face, over its longest edge [-]. Fixed by test_rest_positions_that_degenerate_name_the_faces.
_FOLDED, _FLATTEST = -0.99, 1e-4
_NAMED = 5  # faces in a message


def moved_mesh(
    mesh: TriangleMesh | QuadraticTriangleMesh, rest_positions: Any
) -> TriangleMesh | QuadraticTriangleMesh:
    """Return a mesh with the same elements at other rest positions (n_v, 3) m.

    Raises ValueError for another shape, for faces without area, and for neighbours that lie folded onto each other, as
    where a vertex has crossed the opposite edge; the message names the faces. Of six-node elements they are the flat ones.
    """
    x = quantity("rest_positions", "m", rest_positions, (mesh.n_vertices, 3))
    flat_mesh = mesh.surface if isinstance(mesh, QuadraticTriangleMesh) else mesh
    corners = x[flat_mesh.faces]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # opposite each corner
    across = np.cross(edges[:, 0], edges[:, 1])
    doubled = np.linalg.norm(across, axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    flat = np.flatnonzero(doubled <= _FLATTEST * longest**2)
    if flat.size:
        raise ValueError(
            f"rest_positions [m] leave {_called(flat)} without area: the smallest has {0.5 * doubled[flat].min():.3g} m2"
        )
    inner = flat_mesh.edge_faces[flat_mesh.interior_edges]
    normals, before = across / doubled[:, None], flat_mesh.face_normals
    cosines = [np.einsum("ij,ij->i", n[inner[:, 0]], n[inner[:, 1]]) for n in (normals, before)]
    folded = np.unique(inner[(cosines[0] < _FOLDED) & (cosines[1] >= _FOLDED)])
    if folded.size:
        raise ValueError(
            f"rest_positions [m] fold {_called(folded)} onto each other: a vertex has crossed an edge, or the sheet is "
            "folded flat there"
        )
    return mesh._with_rest_positions(x)


def moved_solid_mesh(mesh: TetMesh, rest_positions: Any) -> TetMesh:
    """Return a mesh with the same tetrahedra at other rest positions (n_v, 3) m.

    Raises ValueError for another shape, and for flat and inverted tetrahedra, which the message names, and what else a
    TetMesh refuses.
    """
    x = quantity("rest_positions", "m", rest_positions, (mesh.n_vertices, 3))
    nodes = x[mesh.tetrahedra]
    volumes = straight_volumes(nodes[:, :4])
    ends = nodes[:, :4][:, EDGES]
    longest = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).max(axis=1)
    bad = volumes <= _FLATTEST * longest**3
    if mesh.order == 2:
        coefficients = jacobians(nodes)
        bad |= coefficients.min(axis=1) <= 0.0
        bad[bad] &= not_positive(coefficients[bad], _FLATTEST * longest[bad] ** 3)
    if bad.any():
        found = np.flatnonzero(bad)
        raise ValueError(
            f"rest_positions [m] leave {_called(found, 'tetrahedron', 'tetrahedra')} flat or inside out: the least "
            f"volume is {volumes[found].min():.3g} m3"
        )
    return mesh._with_rest_positions(x)


def _called(numbers: np.ndarray, one: str = "face", several: str = "faces") -> str:
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"{several if len(numbers) > 1 else one} {', '.join(map(str, numbers[:_NAMED]))}{more}"


def shape_gradients(mesh: TriangleMesh, faces: np.ndarray) -> np.ndarray:
    """Return the gradients of the shape functions of some faces (k,) at rest, (k, 3, 3) 1/m: one row per corner."""
    corners = mesh.rest_positions[mesh.faces[faces]]
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    return np.cross(mesh.face_normals[faces][:, None], opposite) / (
        2.0 * mesh.face_areas[faces][:, None, None]
    )


def by_areas(mesh: TriangleMesh, faces: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to the areas of some faces
    (k,).
    """
    of_areas = (gradient * mesh.face_areas[faces])[:, None, None]
    return _summed(mesh, mesh.faces[faces], of_areas * shape_gradients(mesh, faces))


def by_edge_vectors(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from those with respect to the vectors along some
    edges, (k, 3).
    """
    return _summed(mesh, mesh.edges[edges], np.stack([-gradient, gradient], axis=1))


def by_lengths(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to the lengths of some
    edges (k,).
    """
    if isinstance(mesh, QuadraticTriangleMesh):
        return by_nodal_lengths(mesh, edges, np.repeat(gradient[:, None], 3, axis=1))
    ends = mesh.rest_positions[mesh.edges[edges]]
    along = ends[:, 1] - ends[:, 0]
    unit = along / np.linalg.norm(along, axis=1, keepdims=True)
    return by_edge_vectors(mesh, edges, gradient[:, None] * unit)


def by_nodal_areas(mesh: Any, faces: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to `nodal_areas(mesh,
    faces)`, (k, 3) or (k, 6).
    """
    nodes, parts = sides(mesh)
    if parts == 1:
        return by_areas(mesh, faces, gradient.mean(axis=1))
    nodes = nodes[faces // parts]
    rows = np.empty((*nodes.shape, 3))
    for part, corners in enumerate(FLAT):
        here = faces % parts == part
        rows[here] = six_node_checks.by_shape_integrals(
            mesh.rest_positions[nodes[here]], gradient[here], corners
        )
    return _summed(mesh, nodes, rows)


def by_nodal_element_areas(mesh: QuadraticTriangleMesh, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to the areas of the
    elements' nodes, (n, 6).
    """
    nodes = mesh.elements
    return _summed(mesh, nodes, six_node_checks.by_shape_integrals(mesh.rest_positions[nodes], gradient))


def by_nodal_lengths(mesh: Any, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to `nodal_lengths(mesh,
    edges)`, (k, 2) or (k, 3).
    """
    if not isinstance(mesh, QuadraticTriangleMesh):
        return by_lengths(mesh, edges, gradient.mean(axis=1))
    nodes = mesh.nodes_of_edges[edges]
    return _summed(mesh, nodes, six_node_checks.by_edge_integrals(mesh.rest_positions[nodes], gradient))


def by_width(mesh: Any, gradient: float) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to twice the distance of
    the farthest vertex from the middle of the surface, `width_of`."""
    x, corners = mesh.rest_positions, mesh.rest_positions[mesh.faces].mean(axis=1)
    shares = mesh.face_areas / mesh.face_areas.sum()
    middle = shares @ corners
    away = x - middle
    farthest = int(np.argmax(np.linalg.norm(away, axis=1)))
    by_vertex = 2.0 * gradient * away[farthest] / np.linalg.norm(away[farthest])
    found = by_areas(
        mesh, np.arange(len(mesh.faces)), (corners - middle) @ -by_vertex / mesh.face_areas.sum()
    )
    np.add.at(
        found, mesh.faces, np.broadcast_to(-by_vertex / 3.0, (*mesh.faces.shape, 3)) * shares[:, None, None]
    )
    found[farthest] += by_vertex
    return found


def by_continuations(mesh: TriangleMesh, edges: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to `continuations(mesh,
    edges)`, (k, 3).

    These are t x n, with the unit vector t along the edge as its first face runs it, and the normal n of that face.
    """
    if isinstance(mesh, QuadraticTriangleMesh):
        found = np.zeros((mesh.n_vertices, 3))
        found[mesh._corner_vertices] = by_continuations(mesh.corners, edges, gradient)
        return found
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


def by_nodal_volumes(mesh: TetMesh, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the rest positions, (n_v, 3), from that with respect to integrals of the shape
    functions of all tetrahedra.

    gradient: (n_t, 4) or (n_t, 10).
    """
    nodes = mesh.rest_positions[mesh.tetrahedra]
    if mesh.order == 2:
        return _summed(mesh, mesh.tetrahedra, by_shape_integrals(nodes, gradient))
    edges = nodes[:, 1:] - nodes[:, :1]
    across = np.stack([np.cross(edges[:, (k + 1) % 3], edges[:, (k + 2) % 3]) for k in range(3)], axis=1)
    by_volume = gradient.mean(axis=1)[:, None, None] / 6.0 * across
    rows = np.concatenate([-by_volume.sum(axis=1, keepdims=True), by_volume], axis=1)
    return _summed(mesh, mesh.tetrahedra, rows)


def _summed(mesh: TriangleMesh | TetMesh, vertices: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Sum rows (k, m, 3) on vertices (k, m) to those on all vertices, (n_v, 3)."""
    total = np.zeros((mesh.n_vertices, 3))
    np.add.at(total, vertices, rows)
    return total
