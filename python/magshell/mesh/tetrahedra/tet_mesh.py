"""The tetrahedral mesh: rest positions, tetrahedra of four or ten nodes, parts, and its surface."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..connected import connected_groups
from ..mesh_base import frozen
from ..topology import (
    FACE_NODES,
    FACES,
    MIRRORED,
    edge_table,
    face_table,
    neighbours,
    outer_faces,
    triangles_of,
)
from ..transforms import moved
from ..triangles.triangle_mesh import TriangleMesh
from .checks import (
    check_all_used,
    check_distinct,
    check_duplicates,
    check_faces,
    check_jacobians,
    check_middle_nodes,
    check_range,
    check_surface,
    check_volumes,
)
from .jacobian import quadratic_volumes, straight_volumes
from .quality import TetQuality
from .refine import Projection, linear, quadratic, refined
from .repair import RepairedMesh, repair
from .selection import TetSelection, checked_part_names, checked_parts

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Rotates


class TetMesh(TetSelection):
    """A conforming tetrahedral mesh with a manifold surface, of one or several connected pieces. Immutable.

    Args:
        rest_positions: (n_v, 3), m.
        tetrahedra: (n_t, 4) vertex indices, with (x1 - x0) x (x2 - x0) . (x3 - x0) > 0; or (n_t, 10): the corners, then
            the midside nodes on the edges 01 12 20 03 13 23, in VTK's order. In gmsh's order the last two are exchanged.
        parts: (n_t,), the number of the part (region, material) that each tetrahedron belongs to; all 0 by default.
        part_names: {name: number}.

    Raises:
        ValueError: for coordinates that are not finite, indices out of range, degenerate, inverted or repeated tetrahedra,
            faces of more than two tetrahedra, vertices of none, a surface that touches itself at an edge or a vertex, and
            ten-node tetrahedra whose Jacobian determinant is not positive. The message names the first of them. Some of
            these can be repaired by `TetMesh.repaired`.

    `faces` are the triangles of the surface, oriented outwards, with the vertex numbers of this mesh: one triangle for each
    outer side of a four-node tetrahedron, four flat ones for that of a ten-node one. `surface` is their TriangleMesh.

    >>> corner = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    >>> corner.faces.tolist()
    [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]
    """

    def __init__(
        self,
        rest_positions: Numbers,
        tetrahedra: Numbers,
        parts: Numbers | None = None,
        part_names: dict[str, int] | None = None,
    ):
        positions = quantity("rest_positions", "m", rest_positions, ("n_v", 3))
        nodes = index_array("tetrahedra", tetrahedra)
        check_range(nodes, len(positions))
        check_distinct(nodes)
        self._parts = frozen(checked_parts(parts, len(nodes)))
        self._part_names = checked_part_names(part_names)
        check_all_used(nodes, len(positions))
        check_volumes(positions, nodes)
        check_duplicates(nodes)
        self._face_table = face_table(nodes[:, :4])
        check_faces(nodes[:, :4], self._face_table)
        self._outer = outer_faces(self._face_table)
        check_surface(nodes[self._outer[:, None] // 4, FACES[self._outer % 4]])
        if nodes.shape[1] == 10:
            check_middle_nodes(nodes)
            check_jacobians(positions, nodes)
        self._rest_positions = positions
        self._tetrahedra = frozen(nodes.astype(np.int32))

    def _with_rest_positions(self, rest_positions: np.ndarray) -> TetMesh:
        """Return the same tetrahedra with other rest positions (n_v, 3) m."""
        made = TetMesh(rest_positions, self.tetrahedra, self.parts, self.part_names)
        return made._with_members(self._groups)

    # Copies and worker processes compute the connectivity again, which is cheap.
    def __reduce__(self) -> tuple[Any, ...]:
        made_from = (self.rest_positions, self.tetrahedra, self.parts, self.part_names)
        return TetMesh, made_from, self._groups_state()

    def __repr__(self) -> str:
        extent = " x ".join(f"{length:.4g}" for length in np.ptp(self.rest_positions, axis=0))
        numbers = np.unique(self.parts)
        parts = "1 part" if len(numbers) == 1 else f"{len(numbers)} parts"
        pieces = "1 piece" if self.n_components == 1 else f"{self.n_components} pieces"
        angles = np.degrees([self.quality.smallest_angles.min(), self.quality.largest_angles.max()])
        nodes = "four nodes" if self.order == 1 else "ten nodes"
        return (
            f"TetMesh: {self.n_vertices} vertices, {self.n_tetrahedra} tetrahedra of {nodes}, {self.n_faces} faces on the "
            f"surface\n"
            f"  size: {extent} m, volume {self.volume:.4g} m3, surface {self.face_areas.sum():.4g} m2\n"
            f"  shape: {pieces}, {parts}\n"
            f"  tetrahedra: edges {self.edge_lengths.min():.3g} to {self.edge_lengths.max():.3g} m, dihedral angles "
            f"{angles[0]:.1f} to {angles[1]:.1f} deg, aspect at most {self.quality.aspects.max():.3g}{self._groups_text()}"
        )

    @classmethod
    def repaired(
        cls,
        rest_positions: Numbers,
        tetrahedra: Numbers,
        parts: Numbers | None = None,
        part_names: dict[str, int] | None = None,
        merge_tolerance: Numbers | None = None,
    ) -> RepairedMesh:
        """Build a mesh from data that the constructor would refuse: (mesh, vertex_map, tetrahedron_map, report).

        Vertices closer than `merge_tolerance` [m] become one (by default none do), and tetrahedra that then have a vertex
        twice are dropped. Two corners of inverted tetrahedra are exchanged. Of tetrahedra with the same corners the first
        is kept. Vertices without a tetrahedron are dropped. `report` counts each change; `print(report)` lists them.
        vertex_map (n_v,) and tetrahedron_map (n_t,) map the old numbers to the new ones, -1 for those dropped.

        Raises ValueError for defects that this does not remove: flat tetrahedra, overlaps, a surface that touches itself.

        >>> import magshell as ms
        >>> cube = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
        >>> repaired = TetMesh.repaired(cube.rest_positions, cube.tetrahedra[:, [1, 0, 2, 3]])
        >>> print(repaired.report)
        6 tetrahedra turned
        """
        return repair(cls, rest_positions, tetrahedra, parts, part_names, merge_tolerance)

    # Nodes and elements

    @property
    def rest_positions(self) -> np.ndarray:
        """The positions of the vertices in the reference configuration, (n_v, 3) m, read-only."""
        return self._rest_positions

    @property
    def tetrahedra(self) -> np.ndarray:
        """The vertex indices of each tetrahedron, (n_t, 4) or (n_t, 10) int32, read-only."""
        return self._tetrahedra

    @property
    def corners(self) -> np.ndarray:
        """The corners of each tetrahedron, its first four nodes, (n_t, 4) int32, read-only."""
        return self.tetrahedra[:, :4]

    @property
    def parts(self) -> np.ndarray:
        """The number of the part that each tetrahedron belongs to, (n_t,) int32, read-only."""
        return self._parts

    @property
    def part_names(self) -> dict[str, int]:
        """The names of the parts, {name: number}, as a copy."""
        return dict(self._part_names)

    @property
    def order(self) -> int:
        """The order of the tetrahedra: 1 for four nodes, 2 for ten."""
        return 1 if self.tetrahedra.shape[1] == 4 else 2

    @property
    def n_tetrahedra(self) -> int:
        """The number of tetrahedra."""
        return len(self.tetrahedra)

    # Connectivity

    @cached_property
    def _edge_table(self):
        return edge_table(self.corners)

    @property
    def edges(self) -> np.ndarray:
        """The corners at the ends of each edge, (n_e, 2) int32, lower one first, sorted, read-only."""
        return frozen(self._edge_table.edges)

    @property
    def tetrahedron_edges(self) -> np.ndarray:
        """The edges 01 12 20 03 13 23 of each tetrahedron, (n_t, 6) int32, read-only."""
        return frozen(self._edge_table.tetrahedron_edges)

    @cached_property
    def edge_nodes(self) -> np.ndarray:
        """The midside node of each edge, (n_e,) int32, read-only. Raises ValueError for four-node tetrahedra."""
        if self.order == 1:
            raise ValueError("tetrahedra of four nodes have none on their edges: take second_order()")
        nodes = np.empty(self.n_edges, dtype=np.int32)
        nodes[self.tetrahedron_edges.ravel()] = self.tetrahedra[:, 4:].ravel()
        return frozen(nodes)

    @cached_property
    def _triangles(self) -> tuple[np.ndarray, np.ndarray]:
        faces, owner = triangles_of(self.tetrahedra, self._outer)
        return frozen(faces), frozen(owner.astype(np.int32))

    @property
    def faces(self) -> np.ndarray:
        """The vertex indices of the triangles of the surface, (n_f, 3) int32, oriented outwards, read-only."""
        return self._triangles[0]

    @property
    def faces_of_corners(self) -> np.ndarray:
        """The corners of each outer side of a tetrahedron, (n, 3): one triangle per side also for ten nodes."""
        return self.corners[self._outer[:, None] // 4, FACES[self._outer % 4]]

    @property
    def nodes_of_sides(self) -> np.ndarray:
        """The nodes of each outer side of a tetrahedron, (n, 3) or (n, 6).

        The corners a, b, c come first, then the midside nodes of the edges ab, bc, ca. A side k of six nodes is shown by the
        faces 4 k to 4 k + 3.
        """
        nodes = FACES if self.order == 1 else FACE_NODES
        return self.tetrahedra[self._outer[:, None] // 4, nodes[self._outer % 4]]

    @property
    def face_tetrahedra(self) -> np.ndarray:
        """The tetrahedron behind each face, (n_f,) int32, read-only."""
        return self._triangles[1]

    @cached_property
    def surface(self) -> TriangleMesh:
        """The surface as a TriangleMesh: its faces are `faces`, its vertices `surface_vertices`."""
        surface = TriangleMesh(
            self.rest_positions[self.surface_vertices], np.searchsorted(self.surface_vertices, self.faces)
        )
        if not self._groups:
            return surface
        numbers = np.full(self.n_vertices, -1)
        numbers[self.surface_vertices] = np.arange(len(self.surface_vertices))
        return surface._with_members(surface._existing(self._surface_groups(numbers)))

    @cached_property
    def surface_vertices(self) -> np.ndarray:
        """The number in this mesh of each vertex of `surface`, (n_s,), ascending."""
        return frozen(np.unique(self.faces))

    @property
    def boundary_vertices(self) -> np.ndarray:
        """The indices of the vertices on the surface, ascending."""
        return self.surface_vertices

    @cached_property
    def boundary_edges(self) -> np.ndarray:
        """The indices of the edges on the surface, ascending."""
        nodes = self.faces_of_corners.astype(np.int64)
        ends = np.sort(nodes[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
        keys = self.edges[:, 0].astype(np.int64) * self.n_vertices + self.edges[:, 1]
        return frozen(np.searchsorted(keys, np.unique(ends[:, 0] * self.n_vertices + ends[:, 1])))

    @cached_property
    def components(self) -> np.ndarray:
        """The number, from 0, of the connected piece that each vertex belongs to, (n_v,)."""
        piece = connected_groups(self.n_tetrahedra, neighbours(self._face_table))
        of_vertex = np.empty(self.n_vertices, dtype=np.int32)
        of_vertex[self.tetrahedra] = piece[:, None]
        return frozen(of_vertex)

    # Geometry of the reference configuration

    @cached_property
    def volumes(self) -> np.ndarray:
        """The volumes of the tetrahedra, curved ones for ten nodes, (n_t,) m3."""
        nodes = self.rest_positions[self.tetrahedra]
        return frozen(straight_volumes(nodes) if self.order == 1 else quadratic_volumes(nodes))

    @property
    def volume(self) -> float:
        """The volume of the mesh, m3."""
        return float(self.volumes.sum())

    @cached_property
    def tetrahedron_barycenters(self) -> np.ndarray:
        """The barycenters of the four corners of each tetrahedron, (n_t, 3) m."""
        return frozen(self.rest_positions[self.corners].mean(axis=1))

    @property
    def face_areas(self) -> np.ndarray:
        """The areas of the faces, (n_f,) m2."""
        return self.surface.face_areas

    @property
    def face_normals(self) -> np.ndarray:
        """The outward unit normals of the faces, (n_f, 3)."""
        return self.surface.face_normals

    @property
    def face_barycenters(self) -> np.ndarray:
        """The barycenters of the faces, (n_f, 3) m."""
        return self.surface.face_barycenters

    @cached_property
    def quality(self) -> TetQuality:
        """The quality of the tetrahedra: dihedral angles, radius ratios, aspect ratios, Jacobian determinants."""
        return TetQuality(self)

    def self_intersections(self, positions: Numbers) -> np.ndarray:
        """Find the pairs of faces that pass through each other at positions (n_v, 3) m, (k, 2).

        See `TriangleMesh.self_intersections`.
        """
        return self.surface.self_intersections(np.asarray(positions)[self.surface_vertices])

    # Modified meshes

    def with_parts(self, parts: Numbers, names: dict[str, int] | None = None) -> TetMesh:
        """Return the same mesh with other parts (n_t,), integers or booleans, and names {name: number} for them."""
        return TetMesh(self.rest_positions, self.tetrahedra, parts, names)._with_members(self._groups)

    def second_order(self, surface: Projection | None = None) -> TetMesh:
        """Return the mesh with ten nodes: corners keep their numbers, edge k gets node n_v + k (see `edge_nodes`).

        surface: the curved boundary as a signed distance, (n, 3) m -> (n,) m, such as one of `ms.shapes`. The midside nodes
            of surface edges move onto it if both corners lie on it within 1e-3 of the edge's length. If that would make the
            Jacobian determinant of a tetrahedron too small, they move only part of the way; an ms.MeshQualityWarning says
            how many nodes stay off the surface, and how far. By default all nodes stay in the middle of their edges.
        """
        return self if self.order == 2 else quadratic(self, surface)

    def first_order(self) -> TetMesh:
        """Return the mesh of the corners only, with four-node tetrahedra; vertices are renumbered in the same order."""
        return self if self.order == 1 else linear(self)

    def refined(self, surface: Projection | None = None) -> TetMesh:
        """Return the mesh with each tetrahedron t divided into eight, 8 t to 8 t + 7, at the midpoints of its edges.

        Parts are inherited. Vertices keep their numbers, and midside nodes become corners; of four-node tetrahedra, the
        midpoint of edge k is vertex n_v + k. Repeated refinement produces at most three shapes per tetrahedron.
        surface: as for `second_order`.
        """
        return refined(self, surface)

    def transformed(self, rotation: Rotates | None = None, translation: Numbers | None = None) -> TetMesh:
        """Return the mesh transformed by x -> rotation x + translation.

        rotation: a (3, 3) matrix or a scipy Rotation. Any invertible matrix is allowed; under one that mirrors, corners 0
            and 2 of each tetrahedron are exchanged. translation: (3,), m.
        """
        positions = moved(self.rest_positions, rotation, translation)
        tetrahedra = self.tetrahedra
        if straight_volumes(positions[tetrahedra[:1, :4]])[0] < 0:
            tetrahedra = tetrahedra[:, MIRRORED[: tetrahedra.shape[1]]]
        return TetMesh(positions, tetrahedra, self.parts, self.part_names)._with_members(self._groups)

    def scaled(self, factor: float) -> TetMesh:
        """Return the mesh with all coordinates multiplied by a positive factor."""
        positions = self.rest_positions * positive("factor", "", factor)
        return TetMesh(positions, self.tetrahedra, self.parts, self.part_names)._with_members(self._groups)
