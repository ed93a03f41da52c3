"""Index ranges of a body's vertices, edges and faces among those of all bodies of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ...mesh.mesh_base import MeshBase


class Span(NamedTuple):
    """The index ranges of one body, or of all bodies together.

    mesh: of the body, or the joined mesh. bodies: which of the scene's bodies. The other fields are the numbers in the
    scene of the first vertex, edge, face and edge rotation, and of the first row in a magnetization of all bodies.
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
        """The range of the edges that have rotations; empty for a solid."""
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
    """Return the number of edges that have rotations; zero for a solid."""
    return mesh.n_edges if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh) else 0


def rotations_of(mesh: MeshBase) -> int:
    """Return the number of edge rotations of a mesh: one per edge, two for six-node elements, none for a solid."""
    return turning_edges(mesh) * getattr(mesh, "order", 1)


def magnetized_rows(mesh: MeshBase) -> int:
    """Return the number of rows of a mesh in a magnetization of all bodies: the elements of a sheet, the faces of a
    solid.
    """
    return mesh.n_elements if isinstance(mesh, TriangleMesh | QuadraticTriangleMesh) else mesh.n_faces
