"""Joins the meshes of all bodies of a scene into one, and provides an empty mesh for scenes of rigid bodies only."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class NoMesh(TriangleMesh):
    """An empty mesh, for a scene that has rigid bodies only."""

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
    """The vertices, edges and faces of several bodies, one body after another; of a solid, the faces of its surface."""

    def __init__(self, meshes: list[Any]):
        self.meshes = meshes
        self._first = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])

    def _numbered(self, name: str) -> np.ndarray:
        """Return an array of vertex numbers of all meshes, renumbered for the joined mesh."""
        return np.concatenate(
            [getattr(mesh, name) + first for mesh, first in zip(self.meshes, self._first, strict=False)]
        )

    def _together(self, name: str) -> np.ndarray:
        """Return the rows of an array of all meshes."""
        return np.concatenate([getattr(mesh, name) for mesh in self.meshes])

    @property
    def n_vertices(self) -> int:
        return int(self._first[-1])

    @cached_property
    def rest_positions(self) -> np.ndarray:
        """The positions of the vertices in the rest shape, (n_v, 3) m."""
        return self._together("rest_positions")

    @cached_property
    def edges(self) -> np.ndarray:
        """The edges of sheets, (n_e, 2); solids have none here, as only edges of sheets have rotations."""
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
        """The lengths of the edges of all bodies, inner edges of solids included, (k,) m."""
        return self._together("edge_lengths")

    @cached_property
    def faces(self) -> np.ndarray:
        """The vertices of the faces, (n_f, 3)."""
        return self._numbered("faces")

    @property
    def n_faces(self) -> int:
        return len(self.faces)

    @cached_property
    def face_areas(self) -> np.ndarray:
        """The areas of the faces in the rest shape, (n_f,) m2."""
        return self._together("face_areas")

    @cached_property
    def surface_vertices(self) -> np.ndarray:
        """The vertices of faces, ascending, (n_s,): all vertices of sheets, those on the surface of solids."""
        return np.unique(self.faces)

    @cached_property
    def surface(self) -> TriangleMesh:
        """The faces as a mesh of its own, whose vertices are `surface_vertices`."""
        vertices = self.surface_vertices
        return TriangleMesh(self.rest_positions[vertices], np.searchsorted(vertices, self.faces))

    @property
    def size(self) -> float:
        """The diagonal of the bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.rest_positions, axis=0)))

    @cached_property
    def components(self) -> np.ndarray:
        """The number of the connected component of each vertex, (n_v,)."""
        before = np.cumsum([0, *(mesh.n_components for mesh in self.meshes)])
        return np.concatenate(
            [mesh.components + first for mesh, first in zip(self.meshes, before, strict=False)]
        )

    @property
    def n_components(self) -> int:
        return sum(mesh.n_components for mesh in self.meshes)

    def self_intersections(self, positions: Numbers) -> np.ndarray:
        """Find the faces that pass through each other, (k, 2)."""
        return self.surface.self_intersections(np.asarray(positions)[self.surface_vertices])
