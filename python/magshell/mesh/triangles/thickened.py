"""The closed surface of a shell with its thickness."""

from __future__ import annotations

import numpy as np

from ..connected import connected_groups
from .triangle_mesh import TriangleMesh

# [-] Largest offset at a vertex over half the thickness; 2 is exact for two faces whose normals differ by 120 degrees.
_LONGEST_MITER = 2.0


def thickened(
    mesh: TriangleMesh, positions: np.ndarray, thickness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Build the closed surface of a shell: its two sides, and the walls along its boundary.

    positions: (n_v, 3) m, of the middle surface. thickness: (n_f,) m; half of it lies on either side, along the vertex
    normals. Fans of faces that share only a vertex get separate points there, so that every edge has two faces.

    Returns points (k, 3) m and faces (m, 3). Raises ValueError, which names a face, if the radius of curvature is too small
    for the thickness.
    """
    corner_points = _corner_points(mesh)
    count = int(corner_points.max()) + 1
    faces, vertices = corner_points.reshape(-1, 3), np.zeros(count, dtype=np.int64)
    vertices[corner_points] = mesh.faces.ravel()
    middle = positions[vertices]
    areas = _area_vectors(middle, faces)
    offsets = _offsets(faces, areas, thickness, count)
    points = np.concatenate([middle + offsets, middle - offsets])
    top, bottom = faces, faces[:, ::-1] + count
    _check_sides(points, top, bottom, areas)
    ends = _border(mesh, faces)
    start, end = ends[:, 0], ends[:, 1]
    walls = [
        np.stack([end, start, start + count], axis=1),
        np.stack([end, start + count, end + count], axis=1),
    ]
    return points, np.concatenate([top, bottom, *walls])


def _corner_points(mesh: TriangleMesh) -> np.ndarray:
    """Return the number of the point at each corner of the faces, (3 n_f,); faces that share an edge share points."""
    inner = mesh.interior_edges
    ends, pairs = mesh.edges[inner], mesh.edge_faces[inner]
    corners = [
        [
            3 * pairs[:, side] + np.argmax(mesh.faces[pairs[:, side]] == ends[:, [end]], axis=1)
            for side in (0, 1)
        ]
        for end in (0, 1)
    ]
    one, other = (np.concatenate([corners[end][side] for end in (0, 1)]) for side in (0, 1))
    return connected_groups(3 * mesh.n_faces, np.stack([one, other], axis=1))


def _border(mesh: TriangleMesh, faces: np.ndarray) -> np.ndarray:
    """Return the points at the start and end of each boundary edge, in the direction of its face, (k, 2)."""
    alone = (mesh.edge_faces < 0).any(axis=1)
    rows, opposite = np.nonzero(alone[mesh.face_edges])
    return np.stack([faces[rows, (opposite + 1) % 3], faces[rows, (opposite + 2) % 3]], axis=1)


def _area_vectors(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    x0, x1, x2 = np.moveaxis(points[faces], 1, 0)
    return 0.5 * np.cross(x1 - x0, x2 - x0)


def _offsets(faces: np.ndarray, areas: np.ndarray, thickness: np.ndarray, count: int) -> np.ndarray:
    """Return the vectors from the middle surface to the upper side at each point, (count, 3) m.

    They are longer than half the thickness where faces meet at an angle, so that the faces get their full thickness.
    """
    size = np.linalg.norm(areas, axis=1)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(faces.ravel(), np.repeat(values, 3), minlength=count)

    normals = np.stack([summed(each) for each in areas.T], axis=1)
    length = np.linalg.norm(normals, axis=1)
    if (flat := length <= 1e-9 * summed(size)).any():
        face = np.argmax(flat[faces].any(axis=1))
        raise ValueError(
            f"the normals around face {face} cancel: the shell is folded flat there, and its two sides coincide"
        )
    normals /= length[:, None]
    total = summed(size)
    along = length / total  # mean cosine of the angle between this normal and those of the faces
    half = 0.5 * summed(size * thickness) / total
    return normals * (half * np.minimum(1.0 / along, _LONGEST_MITER))[:, None]


def _check_sides(points: np.ndarray, top: np.ndarray, bottom: np.ndarray, areas: np.ndarray) -> None:
    """Raise ValueError if a face of one side is inverted."""
    for side, sign in ((top, 1.0), (bottom, -1.0)):
        inverted = sign * (_area_vectors(points, side) * areas).sum(axis=1) <= 0.0
        if inverted.any():
            raise ValueError(
                f"the shell is too thick for its curvature at face {np.argmax(inverted)}: the inner side is inverted there. "
                "Give a smaller thickness"
            )
