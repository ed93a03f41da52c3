"""Dead loads and edge couples."""

from __future__ import annotations

import numpy as np

from ._quantity import quantity, real_numbers
from ._selections import indices, selection
from .mesh import TriangleMesh


class PointLoad:
    """A force [N] on each of some vertices: `force` (3,) on every one of them, or (k, 3), one each."""

    _replaceable = ("force",)

    def __init__(self, vertices, force):
        self.vertices = selection("PointLoad vertices", vertices)
        self.force = _vectors("force", "N", force)

    def vertex_forces(self, mesh: TriangleMesh) -> np.ndarray:
        """(n_v, 3), N."""
        vertices, weights = self._shares(mesh)
        return _spread(mesh, vertices, _rows("force [N]", self.force, len(vertices)) * weights)

    def gradients(self, mesh: TriangleMesh, by_vertex_forces: np.ndarray) -> dict[str, np.ndarray]:
        """By the force, one a vertex."""
        return {"force": _gathered(*self._shares(mesh), by_vertex_forces)}

    def replaced(self, *, force) -> PointLoad:
        return PointLoad(self.vertices, force)

    def _shares(self, mesh: TriangleMesh):
        vertices = indices("PointLoad vertices", self.vertices, mesh.n_vertices)
        return vertices[:, None], np.ones((len(vertices), 1))


class EdgeLoad:
    """A force per rest length [N/m] along some edges, half to each end: (3,) or (k, 3), one an edge."""

    _replaceable = ("force_per_length",)

    def __init__(self, edges, force_per_length):
        self.edges = selection("EdgeLoad edges", edges)
        self.force_per_length = _vectors("force_per_length", "N/m", force_per_length)

    def vertex_forces(self, mesh: TriangleMesh) -> np.ndarray:
        """(n_v, 3), N."""
        ends, weights = self._shares(mesh)
        return _spread(mesh, ends, _rows("force_per_length [N/m]", self.force_per_length, len(ends)) * weights)

    def gradients(self, mesh: TriangleMesh, by_vertex_forces: np.ndarray) -> dict[str, np.ndarray]:
        """By the force per length, one an edge."""
        return {"force_per_length": _gathered(*self._shares(mesh), by_vertex_forces)}

    def replaced(self, *, force_per_length) -> EdgeLoad:
        return EdgeLoad(self.edges, force_per_length)

    def _shares(self, mesh: TriangleMesh):
        edges = indices("EdgeLoad edges", self.edges, mesh.n_edges)
        return mesh.edges[edges], (mesh.edge_lengths[edges] / 2.0)[:, None]


class AreaLoad:
    """A force per rest area [N/m2] on the sheet, or on some faces only: (3,) or (k, 3), one a face."""

    _replaceable = ("force_per_area",)

    def __init__(self, force_per_area, faces=None):
        self.faces = None if faces is None else selection("AreaLoad faces", faces)
        self.force_per_area = _vectors("force_per_area", "N/m2", force_per_area)

    def vertex_forces(self, mesh: TriangleMesh) -> np.ndarray:
        """(n_v, 3), N."""
        corners, weights = self._shares(mesh)
        return _spread(mesh, corners, _rows("force_per_area [N/m2]", self.force_per_area, len(corners)) * weights)

    def gradients(self, mesh: TriangleMesh, by_vertex_forces: np.ndarray) -> dict[str, np.ndarray]:
        """By the force per area, one a face."""
        return {"force_per_area": _gathered(*self._shares(mesh), by_vertex_forces)}

    def replaced(self, *, force_per_area) -> AreaLoad:
        return AreaLoad(force_per_area, self.faces)

    def _shares(self, mesh: TriangleMesh):
        faces = np.arange(mesh.n_faces) if self.faces is None else indices("AreaLoad faces", self.faces, mesh.n_faces)
        return mesh.faces[faces], (mesh.face_areas[faces] / 3.0)[:, None]


class EdgeCouple:
    """A couple per rest length [N] turning the director of free boundary edges about the edge itself.

    couple_per_length: a number, about the edge's direction with the sheet on its left (seen from the side its normals
        point to); positive lifts nothing but turns as a right hand along that direction does. Or a vector (3,), of which
        the part along each rest edge counts. The axis follows the edge.
    """

    _replaceable = ("couple_per_length",)

    def __init__(self, edges, couple_per_length):
        self.edges = selection("EdgeCouple edges", edges)
        array = real_numbers("couple_per_length [N]", couple_per_length)
        if array.shape not in ((), (3,)):
            raise ValueError(f"couple_per_length [N] must be a number or have shape (3,), got {array.shape}")
        self.couple_per_length = quantity("couple_per_length", "N", array, array.shape)

    def edge_couples(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """The edges (k,) and their couples (k,), N m."""
        edges, along = self._along(mesh)
        return edges, along @ np.atleast_1d(self.couple_per_length)

    def gradients(self, mesh: TriangleMesh, by_edge_couples: np.ndarray) -> dict[str, np.ndarray]:
        """By the couple per length, given those by the couple on every edge of the mesh (n_e,)."""
        edges, along = self._along(mesh)
        return {"couple_per_length": by_edge_couples[edges] @ along}

    def replaced(self, *, couple_per_length) -> EdgeCouple:
        changed = EdgeCouple(self.edges, couple_per_length)
        if changed.couple_per_length.shape != self.couple_per_length.shape:
            raise ValueError(
                f"couple_per_length [N] must keep its shape {self.couple_per_length.shape}, "
                f"got {changed.couple_per_length.shape}"
            )
        return changed

    def _along(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """The edges and what a couple per length is multiplied by: lengths (k, 1), or edge vectors (k, 3)."""
        edges = indices("EdgeCouple edges", self.edges, mesh.n_edges)
        inside = np.setdiff1d(edges, mesh.boundary_edges)
        if inside.size:
            raise ValueError(f"EdgeCouple edges must be on the boundary, but edge {inside[0]} is not")
        lengths = mesh.edge_lengths[edges]
        if self.couple_per_length.ndim == 0:
            return edges, lengths[:, None]
        ends = mesh.rest_positions[mesh.edges[edges]]
        along = (ends[:, 1] - ends[:, 0]) * np.where(mesh.edge_faces[edges, 0] >= 0, 1.0, -1.0)[:, None]
        return edges, along


def _vectors(name: str, unit: str, values) -> np.ndarray:
    array = real_numbers(f"{name} [{unit}]", values)
    if array.ndim not in (1, 2) or array.shape[-1] != 3:
        raise ValueError(f"{name} [{unit}] must have shape (3,) or (k, 3), got {array.shape}")
    return quantity(name, unit, array, array.shape)


def _rows(label: str, vectors: np.ndarray, count: int) -> np.ndarray:
    if vectors.ndim == 2 and len(vectors) != count:
        raise ValueError(f"{label} must have shape (3,) or ({count}, 3), got {vectors.shape}")
    return np.broadcast_to(vectors, (count, 3))


def _spread(mesh: TriangleMesh, vertices: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Each row's force on each of the row's vertices."""
    at_vertices = np.zeros((mesh.n_vertices, 3))
    np.add.at(at_vertices, vertices, forces[:, None, :])
    return at_vertices


def _gathered(vertices: np.ndarray, weights: np.ndarray, by_vertex_forces: np.ndarray) -> np.ndarray:
    """The transpose of spreading: one gradient a row of vertices."""
    return by_vertex_forces[vertices].sum(axis=1) * weights
