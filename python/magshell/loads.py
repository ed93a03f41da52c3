"""Dead loads and edge couples."""

from __future__ import annotations

import numpy as np

from ._owner import Owner
from ._quantity import quantity, real_numbers
from ._selections import indices, selection
from .mesh import TriangleMesh


class DeadLoad(Owner):
    """Forces that keep size and direction, given by one value: so much of it on each of some parts of the mesh."""

    def __init__(self, label: str, values):
        """label: the name and unit of the value."""
        self._label = label
        setattr(self, self._replaceable[0], _vectors(*label.rstrip("]").split(" [", 1), values))

    def vertex_forces(self, mesh: TriangleMesh) -> np.ndarray:
        """(n_v, 3), N."""
        vertices, weights = self._shares(mesh)
        rows = _rows(self._label, getattr(self, self._replaceable[0]), len(vertices))
        return _spread(mesh, vertices, rows * weights)

    def add_numbers(self, label: str, values, numbers: dict) -> None:
        key = ("loads", "forces")
        numbers[key] = numbers.get(key, 0.0) + self.vertex_forces(values.scene.mesh)

    def gradients(self, label: str, values, gradient) -> dict[str, np.ndarray]:
        vertices, weights = self._shares(values.scene.mesh)
        by_forces = gradient.value("loads", "forces")
        return {self._replaceable[0]: by_forces[vertices].sum(axis=1) * weights}

    def _shares(self, mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
        """The vertices of each part (k, m), and how much of the value each of them feels (k, 1)."""
        raise TypeError(f"{type(self).__name__} is no load of its own")


class PointLoad(DeadLoad):
    """A force [N] on each of some vertices: `force` (3,) on every one of them, or (k, 3), one each."""

    _replaceable = ("force",)

    def __init__(self, vertices, force):
        self.vertices = selection("PointLoad vertices", vertices)
        super().__init__("force [N]", force)

    def replaced(self, *, force) -> PointLoad:
        return PointLoad(self.vertices, force)

    def _shares(self, mesh: TriangleMesh):
        vertices = indices("PointLoad vertices", self.vertices, mesh.n_vertices)
        return vertices[:, None], np.ones((len(vertices), 1))


class EdgeLoad(DeadLoad):
    """A force per rest length [N/m] along some edges, half to each end: (3,) or (k, 3), one an edge."""

    _replaceable = ("force_per_length",)

    def __init__(self, edges, force_per_length):
        self.edges = selection("EdgeLoad edges", edges)
        super().__init__("force_per_length [N/m]", force_per_length)

    def replaced(self, *, force_per_length) -> EdgeLoad:
        return EdgeLoad(self.edges, force_per_length)

    def _shares(self, mesh: TriangleMesh):
        edges = indices("EdgeLoad edges", self.edges, mesh.n_edges)
        return mesh.edges[edges], (mesh.edge_lengths[edges] / 2.0)[:, None]


class AreaLoad(DeadLoad):
    """A force per rest area [N/m2] on the sheet, or on some faces only: (3,) or (k, 3), one a face."""

    _replaceable = ("force_per_area",)

    def __init__(self, force_per_area, faces=None):
        self.faces = None if faces is None else selection("AreaLoad faces", faces)
        super().__init__("force_per_area [N/m2]", force_per_area)

    def replaced(self, *, force_per_area) -> AreaLoad:
        return AreaLoad(force_per_area, self.faces)

    def _shares(self, mesh: TriangleMesh):
        faces = (
            np.arange(mesh.n_faces)
            if self.faces is None
            else indices("AreaLoad faces", self.faces, mesh.n_faces)
        )
        return mesh.faces[faces], (mesh.face_areas[faces] / 3.0)[:, None]


class EdgeCouple(Owner):
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

    def add_numbers(self, label: str, values, numbers: dict) -> None:
        key, turned = ("couples", "couples"), values.scene._couple_edges
        edges, couples = self.edge_couples(values.scene.mesh)
        by_edge = np.bincount(edges, weights=couples, minlength=values.scene.mesh.n_edges)
        numbers[key] = numbers.get(key, 0.0) + by_edge[turned]

    def gradients(self, label: str, values, gradient) -> dict[str, np.ndarray]:
        edges, along = self._along(values.scene.mesh)
        of_edges = np.searchsorted(values.scene._couple_edges, edges)
        return {"couple_per_length": gradient.value("couples", "couples")[of_edges] @ along}

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
