"""The mesh of a scene without sheets."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..mesh.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


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
