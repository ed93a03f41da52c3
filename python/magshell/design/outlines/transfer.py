"""Values transferred from the vertices or faces of one flat mesh to those of another by interpolation."""

from __future__ import annotations

import numpy as np
import scipy

from ...mesh.triangles.triangle_mesh import TriangleMesh

_NEAR = 16  # faces whose barycenters are nearest to a point, among which its face is sought first
_OUTSIDE = 1e-9  # [-] negative barycentric coordinate, by round-off, of a point in a face
_INWARDS = 1e-3  # [-] of the way to the barycenters of the faces around it, by which a vertex is moved to find its face
_DIVISIONS = 4  # of each edge of a face, into 16 parts whose values are averaged


class FaceLocator:
    """Finds the faces of a flat mesh in which points lie. positions: (n_v, 2) m. faces: (n_f, 3)."""

    def __init__(self, positions: np.ndarray, faces: np.ndarray):
        self.positions: np.ndarray = positions
        self.faces: np.ndarray = faces
        corners = positions[faces]
        self._origins = corners[:, 2]
        self._to_coordinates = np.linalg.inv(np.swapaxes(corners[:, :2] - corners[:, 2:], 1, 2))
        self._tree = scipy.spatial.cKDTree(corners.mean(axis=1))

    def faces_of(self, points: np.ndarray) -> np.ndarray:
        """Return the face of each point (n, 2), (n,); of one outside, the face that it leaves least."""
        count = min(_NEAR, len(self.faces))
        nearest = self._tree.query(points, count)[1].reshape(len(points), count)
        inside = self.coordinates(nearest, points[:, None]).min(axis=2)
        best = inside.argmax(axis=1)
        rows = np.arange(len(points))
        found = nearest[rows, best]
        for k in np.flatnonzero(inside[rows, best] < -_OUTSIDE):
            found[k] = self.coordinates(np.arange(len(self.faces)), points[k]).min(axis=1).argmax()
        return found

    def coordinates(self, faces: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return barycentric coordinates (..., 3) of points (..., 2) in faces (...)."""
        first = np.einsum("...ij,...j->...i", self._to_coordinates[faces], points - self._origins[faces])
        return np.concatenate([first, 1.0 - first.sum(axis=-1, keepdims=True)], axis=-1)


def between_vertices(locator: FaceLocator, mesh: TriangleMesh) -> scipy.sparse.csr_array:
    """Return the matrix that interpolates values of the vertices of a located mesh at those of another, (n_v, n_old).

    A vertex on a slit takes the values of its own side: its face is sought a little inside.
    """
    points = mesh.rest_positions[:, :2]
    around = np.zeros_like(points)
    np.add.at(around, mesh.faces.ravel(), np.repeat(mesh.face_barycenters[:, :2], 3, axis=0))
    around /= np.bincount(mesh.faces.ravel(), minlength=len(points))[:, None]
    found = locator.faces_of(points + _INWARDS * (around - points))
    weights = locator.coordinates(found, points)
    rows = np.repeat(np.arange(len(points)), 3)
    shape = (len(points), len(locator.positions))
    return scipy.sparse.csr_array((weights.ravel(), (rows, locator.faces[found].ravel())), shape=shape)


def between_faces(locator: FaceLocator, corners: np.ndarray) -> scipy.sparse.csr_array:
    """Return the matrix that averages values of the faces of a located mesh over other faces, (n_f, n_old).

    corners: (n_f, 3, 2) m, of the other faces. Each is divided into 16 equal parts, whose values are those of the face in
    which their barycenters lie.
    """
    shares = _barycenters_of_parts(_DIVISIONS)
    points = np.einsum("kc,fci->fki", shares, corners).reshape(-1, 2)
    found = locator.faces_of(points)
    rows = np.repeat(np.arange(len(corners)), len(shares))
    values = np.full(len(rows), 1.0 / len(shares))
    made = scipy.sparse.csr_array((values, (rows, found)), shape=(len(corners), len(locator.faces)))
    made.sum_duplicates()
    return made


def _barycenters_of_parts(n: int) -> np.ndarray:
    """Return the barycentric coordinates (n^2, 3) of the barycenters of n^2 equal parts of a triangle."""
    i, j = np.mgrid[:n, :n]
    upright = np.stack([i, j], axis=-1)[i + j < n] + 1.0 / 3.0
    inverted = np.stack([i, j], axis=-1)[i + j < n - 1] + 2.0 / 3.0
    first = np.concatenate([upright, inverted]) / n
    return np.column_stack([first, 1.0 - first.sum(axis=1)])
