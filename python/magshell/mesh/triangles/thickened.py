"""The closed surface around a sheet that has a thickness."""

from __future__ import annotations

import numpy as np
import scipy

from .triangle_mesh import TriangleMesh

_LONGEST_MITER = 2.0  # of the offset at a vertex over half of the thickness: that of a fold by 120 degrees


def thickened(
    mesh: TriangleMesh, positions: np.ndarray, thickness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(points (k, 3) m, faces (m, 3)) of both sides of a sheet at `positions`, and of the walls along its border.

    thickness: (n_f,) m; half of it goes to either side, along the normals at the vertices. Where fans of faces share
    nothing but a vertex, each has points of its own, so that every edge has two faces.
    Raises ValueError, naming a face, where the sheet bends more sharply than its thickness allows.
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
    """(3 n_f,): the number of the point that each corner of a face is: one where faces are joined along an edge."""
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
    size = 3 * mesh.n_faces
    graph = scipy.sparse.coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(size, size))
    return scipy.sparse.csgraph.connected_components(graph, directed=False)[1]


def _border(mesh: TriangleMesh, faces: np.ndarray) -> np.ndarray:
    """(k, 2): points at the start and the end of each edge with one face, as that face runs along it."""
    alone = (mesh.edge_faces < 0).any(axis=1)
    rows, opposite = np.nonzero(alone[mesh.face_edges])
    return np.stack([faces[rows, (opposite + 1) % 3], faces[rows, (opposite + 2) % 3]], axis=1)


def _area_vectors(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    x0, x1, x2 = np.moveaxis(points[faces], 1, 0)
    return 0.5 * np.cross(x1 - x0, x2 - x0)


def _offsets(faces: np.ndarray, areas: np.ndarray, thickness: np.ndarray, count: int) -> np.ndarray:
    """(count, 3) m, from the middle to the upper side: so far that the faces around are as thick as they should be."""
    size = np.linalg.norm(areas, axis=1)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.bincount(faces.ravel(), np.repeat(values, 3), minlength=count)

    normals = np.stack([summed(each) for each in areas.T], axis=1)
    length = np.linalg.norm(normals, axis=1)
    if (flat := length <= 1e-9 * summed(size)).any():
        face = np.argmax(flat[faces].any(axis=1))
        raise ValueError(
            f"the normals around face {face} cancel: the sheet is folded flat there, and has no sides"
        )
    normals /= length[:, None]
    total = summed(size)
    along = length / total  # the mean of the cosines between normals of faces and this one
    half = 0.5 * summed(size * thickness) / total
    return normals * (half * np.minimum(1.0 / along, _LONGEST_MITER))[:, None]


def _check_sides(points: np.ndarray, top: np.ndarray, bottom: np.ndarray, areas: np.ndarray) -> None:
    for side, sign in ((top, 1.0), (bottom, -1.0)):
        turned = sign * (_area_vectors(points, side) * areas).sum(axis=1) <= 0.0
        if turned.any():
            raise ValueError(
                f"the sheet is too thick to bend as it does at face {np.argmax(turned)}: its inner side would turn over. "
                "Give a smaller thickness"
            )
