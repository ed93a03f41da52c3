"""Joins the meshes of bodies into one; there may be none."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class NoMesh(TriangleMesh):
    """Of a scene that has rigid parts only."""

    size = 0.0
    n_components = 0

    def __init__(self):
        self.rest_positions, self.edge_lengths = np.zeros((0, 3)), np.zeros(0)
        self.faces = self.face_edges = np.zeros((0, 3), dtype=np.int32)
        self.edges = self.edge_faces = np.zeros((0, 2), dtype=np.int32)
        self.components = np.zeros(0, dtype=np.int32)

    def __reduce__(self) -> tuple[Any, ...]:
        return NoMesh, ()

    def __repr__(self) -> str:
        return "no mesh"

    def self_intersections(self, positions: Numbers | None = None) -> np.ndarray:
        return np.zeros((0, 2), dtype=np.int32)


class JoinedMesh:
    """Vertices, edges and faces (of a solid, those of its surface) of one body after another."""

    def __init__(self, meshes: list[Any]):
        self.meshes = meshes
        self._first = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])

    def _numbered(self, name: str) -> np.ndarray:
        return np.concatenate(
            [getattr(mesh, name) + first for mesh, first in zip(self.meshes, self._first, strict=False)]
        )

    def _together(self, name: str) -> np.ndarray:
        return np.concatenate([getattr(mesh, name) for mesh in self.meshes])

    @property
    def n_vertices(self) -> int:
        return int(self._first[-1])

    @cached_property
    def rest_positions(self) -> np.ndarray:
        """(n_v, 3), m."""
        return self._together("rest_positions")

    @cached_property
    def edges(self) -> np.ndarray:
        """(n_e, 2), of sheets alone: those that have rotations."""
        sheets = [
            mesh.edges + first
            for mesh, first in zip(self.meshes, self._first, strict=False)
            if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh)
        ]
        return np.concatenate(sheets) if sheets else np.zeros((0, 2), dtype=np.int32)

    @property
    def n_edges(self) -> int:
        return len(self.edges)

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """(k,) m, of all bodies, solids' inner ones as well."""
        return self._together("edge_lengths")

    @cached_property
    def faces(self) -> np.ndarray:
        """(n_f, 3)."""
        return self._numbered("faces")

    @property
    def n_faces(self) -> int:
        return len(self.faces)

    @cached_property
    def face_areas(self) -> np.ndarray:
        """(n_f,), m2."""
        return self._together("face_areas")

    @cached_property
    def surface_vertices(self) -> np.ndarray:
        """(n_s,): all of sheets, of solids those on the surface, ascending."""
        return np.unique(self.faces)

    @cached_property
    def surface(self) -> TriangleMesh:
        """The faces, as a mesh of its own: its vertices are `surface_vertices`."""
        vertices = self.surface_vertices
        return TriangleMesh(self.rest_positions[vertices], np.searchsorted(vertices, self.faces))

    @property
    def size(self) -> float:
        """The diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.rest_positions, axis=0)))

    @cached_property
    def components(self) -> np.ndarray:
        """(n_v,): the number of the connected piece each vertex belongs to."""
        before = np.cumsum([0, *(mesh.n_components for mesh in self.meshes)])
        return np.concatenate(
            [mesh.components + first for mesh, first in zip(self.meshes, before, strict=False)]
        )

    @property
    def n_components(self) -> int:
        return sum(mesh.n_components for mesh in self.meshes)

    def self_intersections(self, positions: Numbers) -> np.ndarray:
        """The faces that pass through each other, (k, 2)."""
        return self.surface.self_intersections(np.asarray(positions)[self.surface_vertices])
