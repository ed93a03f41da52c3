"""Selection of vertices, edges and faces of a mesh by their position.

Every selection returns ascending indices. A selection that finds nothing raises a ValueError that says what lies nearest: an
empty support would otherwise be noticed much later, as a body that flies away.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._input.arrays import index_array
from .._input.quantity import quantity
from .._input.scalars import not_negative
from .._input.selections import Indices

if TYPE_CHECKING:
    from .._input.kinds import Numbers


# [-] Default tolerance of positions, relative to the diagonal of the bounding box: far above round-off, far below any edge.
RELATIVE_TOLERANCE = 1e-6

_PLURAL = {
    "vertex": "vertices",
    "edge": "edges",
    "face": "faces",
    "element": "elements of six nodes",
    "tetrahedron": "tetrahedra",
}


class MeshSelection:
    """Base class of all meshes with the methods that select vertices, edges and faces."""

    def vertices_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Select the vertices whose given coordinates [m] match within `tolerance` [m].

        The default tolerance is 1e-6 of the diagonal of the bounding box.

        >>> import magshell as ms
        >>> ms.meshes.rectangle(2.0, 1.0, cells=(2, 1)).vertices_at(x=0.0).tolist()
        [0, 1]
        """
        wanted, tolerance = self._coordinates(x, y, z, tolerance)
        found = np.flatnonzero(self._matches(wanted, tolerance))
        if len(found) == 0:
            raise ValueError(self._nothing_at("vertex", wanted, tolerance))
        return Indices(found, "vertices", self.n_vertices)

    def edges_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Select the edges with both ends at the given coordinates [m]; see `vertices_at`."""
        return self._at("edge", self.edges, x, y, z, tolerance)

    def faces_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Select the faces with all three vertices at the given coordinates [m]; see `vertices_at`."""
        return self._at("face", self.faces, x, y, z, tolerance)

    def vertices_where(self, predicate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Select the vertices for which `predicate` is True; it maps positions (n_v, 3) [m] to booleans (n_v,)."""
        return _where("vertex", predicate, self.rest_positions, np.arange(self.n_vertices))

    def edges_where(
        self, predicate: Callable[[np.ndarray], np.ndarray], boundary_only: bool = False
    ) -> np.ndarray:
        """Select the edges, all or those on the boundary only, for which `predicate` is True.

        predicate: maps the midpoints of the edges, (n, 3) [m], to booleans (n,).

        >>> import magshell as ms
        >>> mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1))
        >>> len(mesh.edges_where(lambda midpoints: midpoints[:, 0] > 1.0, boundary_only=True))
        3
        """
        if not boundary_only:
            return _where("edge", predicate, self.edge_midpoints, np.arange(self.n_edges))
        if len(self.boundary_edges) == 0:
            raise ValueError("the mesh is closed: it has no boundary edges")
        boundary = self.boundary_edges
        return _where("boundary edge", predicate, self.edge_midpoints[boundary], boundary, self.n_edges)

    def faces_where(self, predicate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Select the faces for which `predicate` is True; it maps barycenters (n_f, 3) [m] to booleans (n_f,)."""
        return _where("face", predicate, self.face_barycenters, np.arange(self.n_faces))

    def nearest_vertex(self, point: Numbers) -> int:
        """Return the vertex nearest to a point (3,) [m]; of several, the one with the lowest index."""
        point = quantity("point", "m", point, (3,))
        return int(np.argmin(np.linalg.norm(self.rest_positions - point, axis=1)))

    def edges_between(self, vertex_indices: Numbers) -> np.ndarray:
        """Select the edges with both ends among the given vertices."""
        indices = index_array("vertex_indices", vertex_indices).ravel()
        outside = indices[(indices < 0) | (indices >= self.n_vertices)]
        if len(outside):
            raise ValueError(
                f"vertex_indices names vertex {outside[0]}, but they are numbered 0 to {self.n_vertices - 1}"
            )
        found = rows_among(self.edges, indices, self.n_vertices)
        if len(found) == 0:
            raise ValueError(f"no edge joins two of the {len(indices)} vertices given")
        return Indices(found, "edges", self.n_edges)

    def _coordinates(self, x, y, z, tolerance) -> tuple[dict[int, float], float]:
        wanted = {
            axis: float(quantity("xyz"[axis], "m", value, ()))
            for axis, value in enumerate((x, y, z))
            if value is not None
        }
        if not wanted:
            raise ValueError("give at least one of x, y, z [m]")
        if tolerance is None:
            tolerance = RELATIVE_TOLERANCE * self.size
        return wanted, not_negative("tolerance", "m", tolerance)

    def _matches(self, wanted: dict[int, float], tolerance: float) -> np.ndarray:
        axes, values = list(wanted), list(wanted.values())
        return (np.abs(self.rest_positions[:, axes] - values) <= tolerance).all(axis=1)

    def _at(self, kind: str, members: np.ndarray, x, y, z, tolerance) -> np.ndarray:
        wanted, tolerance = self._coordinates(x, y, z, tolerance)
        matching = self._matches(wanted, tolerance)
        found = np.flatnonzero(matching[members].all(axis=1))
        if len(found) == 0 and matching.any():
            raise ValueError(
                f"no {kind} has all its vertices at {_describe(wanted)} m, "
                f"though vertex {np.argmax(matching)} is there"
            )
        if len(found) == 0:
            raise ValueError(self._nothing_at(kind, wanted, tolerance))
        return Indices(found, _PLURAL[kind], len(members))

    def _nothing_at(self, kind: str, wanted: dict[int, float], tolerance: float) -> str:
        axes, values = list(wanted), list(wanted.values())
        distance = np.abs(self.rest_positions[:, axes] - values).max(axis=1)
        nearest = int(np.argmin(distance))
        there = {axis: self.rest_positions[nearest, axis] for axis in axes}
        return (
            f"no {kind} at {_describe(wanted)} m (tolerance {tolerance:.3g} m): "
            f"the nearest vertex, {nearest}, has {_describe(there)}"
        )


def _describe(coordinates: dict[int, float]) -> str:
    return ", ".join(f"{'xyz'[axis]} = {value:.9g}" for axis, value in coordinates.items())


def _where(
    kind: str,
    predicate: Callable[..., Any],
    points: np.ndarray,
    indices: np.ndarray,
    total: int | None = None,
) -> np.ndarray:
    mask = np.asarray(predicate(points))
    if mask.shape != (len(points),) or mask.dtype != bool:
        raise ValueError(
            f"the predicate must return {len(points)} booleans for {len(points)} points, "
            f"got shape {mask.shape}, dtype {mask.dtype}"
        )
    if not mask.any():
        low, high = points.min(axis=0), points.max(axis=0)
        spans = ", ".join(f"{name} {low[i]:.6g} to {high[i]:.6g}" for i, name in enumerate("xyz"))
        raise ValueError(f"the predicate holds for no {kind}; they span {spans} m")
    return Indices(indices[mask], _PLURAL[kind.split()[-1]], len(points) if total is None else total)


def rows_among(rows: np.ndarray, vertices: np.ndarray, n_vertices: int) -> np.ndarray:
    """Return the numbers of the rows (n, k) of vertices that are all among the given ones."""
    chosen = np.zeros(n_vertices, dtype=bool)
    chosen[vertices] = True
    return np.flatnonzero(chosen[rows].all(axis=1))
