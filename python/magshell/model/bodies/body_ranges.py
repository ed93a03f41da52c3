"""Where a body has its vertices, edges and faces among those of all bodies of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ...mesh.mesh_base import MeshBase


class Span(NamedTuple):
    """One body, or all of them: `mesh`, and the numbers in the scene of its first vertex, edge and face, of its first
    rotation, and of its first row in a magnetization of all bodies.

    bodies: which of the scene's they are.
    """

    mesh: TriangleMesh
    bodies: slice
    first_vertex: int = 0
    first_edge: int = 0
    first_face: int = 0
    first_rotation: int = 0
    first_row: int = 0

    @property
    def vertices(self) -> slice:
        return slice(self.first_vertex, self.first_vertex + self.mesh.n_vertices)

    @property
    def edges(self) -> slice:
        """Those that may turn: a solid has none."""
        return slice(self.first_edge, self.first_edge + turning_edges(self.mesh))

    @property
    def faces(self) -> slice:
        return slice(self.first_face, self.first_face + self.mesh.n_faces)

    @property
    def rotations(self) -> slice:
        return slice(self.first_rotation, self.first_rotation + rotations_of(self.mesh))

    @property
    def rows(self) -> slice:
        return slice(self.first_row, self.first_row + magnetized_rows(self.mesh))


def turning_edges(mesh: MeshBase) -> int:
    """How many edges the core has for a mesh: of a solid, none."""
    return mesh.n_edges if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh) else 0


def rotations_of(mesh: MeshBase) -> int:
    """How many rotations it has: one an edge, two where there are six nodes, of a solid none."""
    return turning_edges(mesh) * getattr(mesh, "order", 1)


def magnetized_rows(mesh: MeshBase) -> int:
    """How many rows it has in a magnetization of all bodies: one an element of a sheet, of a solid one a face."""
    return mesh.n_elements if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh) else mesh.n_faces
