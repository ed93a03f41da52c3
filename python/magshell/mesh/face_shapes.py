"""Faces of a mesh with the shapes of its elements: of ten-node tetrahedra a side has six nodes and is shown as four flat
triangles, but what acts on one of them is shared out over all six."""

from __future__ import annotations

import numpy as np

from .tet_mesh import TetMesh
from .tet_topology import FLAT

_NODES = np.array(
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]
)  # parameters of six nodes


def sides(mesh) -> tuple[np.ndarray, int]:
    """The nodes of each side, (n, 3) or (n, 6), and how many of the mesh's faces it is: face f is part f % parts of side
    f // parts."""
    if isinstance(mesh, TetMesh) and mesh.order == 2:
        return mesh.nodes_of_sides, len(FLAT)
    return mesh.faces, 1


def shares(mesh, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whose nodes feel what acts on the area at rest of some faces (k,), and how much of it: (k, 3) or (k, 6) vertices,
    and the integrals of their shape functions over the face, m2, likewise."""
    nodes, parts = sides(mesh)
    if parts == 1:
        return nodes[faces], np.repeat(mesh.face_areas[faces, None] / 3.0, 3, axis=1)
    nodes = nodes[faces // parts]
    weights = np.empty(nodes.shape)
    for part, corners in enumerate(FLAT):
        here = faces % parts == part
        weights[here] = _integrals(mesh.rest_positions[nodes[here]], _NODES[corners])
    return nodes, weights


def _integrals(positions: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(k, 6), m2: of the shape functions over a triangle of the parameters, on sides (k, 6, 3)."""
    points, weights = rule(corners)
    values, slopes = shapes(points)
    along = np.einsum("pan,kni->apki", slopes, positions)
    densities = np.linalg.norm(np.cross(along[0], along[1]), axis=2)
    return np.einsum("p,pk,pn->kn", weights, densities, values)


def rule(corners: np.ndarray, order: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 2) and weights (p,): Gauss's rule for the square, drawn together into a triangle (3, 2)."""
    at, lengths = np.polynomial.legendre.leggauss(order)
    u, v = (each.ravel() for each in np.meshgrid((at + 1) / 2, (at + 1) / 2))
    weights = np.outer(lengths, lengths).ravel() / 4 * (1 - u)
    first, second = corners[1:] - corners[0]
    area2 = first[0] * second[1] - first[1] * second[0]
    return corners[0] + u[:, None] * first + (v * (1 - u))[:, None] * second, weights * area2


def shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of six nodes at points (p, 2): (p, 6), and their slopes (p, 2, 6)."""
    s, t = points.T
    corner = np.stack([1 - s - t, s, t], axis=1)
    slope = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    following = [1, 2, 0]
    values = [corner * (2 * corner - 1), 4 * corner * corner[:, following]]
    slopes = [
        slope * (4 * corner - 1)[:, None],
        4 * (corner[:, None] * slope[:, following] + corner[:, None, following] * slope),
    ]
    return np.concatenate(values, axis=1), np.concatenate(slopes, axis=2)
