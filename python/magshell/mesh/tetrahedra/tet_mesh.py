"""The mesh of tetrahedra: rest positions, tetrahedra of four or ten nodes, parts, and the surface around them."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..mesh_base import frozen
from ..topology import (
    FACE_NODES,
    FACES,
    MIRRORED,
    edge_table,
    face_table,
    groups,
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
from .repair import Mended, mended
from .selection import TetSelection, checked_part_names, checked_parts

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Rotates


class TetMesh(TetSelection):
    """A conforming mesh of tetrahedra with a manifold surface, of one piece or several. Immutable.

    Args:
        rest_positions: (n_v, 3), m.
        tetrahedra: (n_t, 4) vertex indices, with (x1 - x0) x (x2 - x0) . (x3 - x0) > 0; or (n_t, 10): the corners, then
            the nodes on the edges 01 12 20 03 13 23, VTK's order. gmsh's has the last two exchanged.
        parts: (n_t,), a number for each tetrahedron: the part (region, material) it belongs to; all 0 by default.
        part_names: {name: number}.

    Raises:
        ValueError: naming the first offenders: coordinates that are not finite, indices out of range, degenerate,
            inverted or doubled tetrahedra, faces of more than two, vertices that belong to none, a surface that touches
            itself in an edge or a vertex, ten nodes between which the Jacobian is not positive. `TetMesh.repaired` mends
            what can be, and says what it did.

    `faces` are the triangles of the surface, outwards, in the numbers of this mesh's vertices: one for each face of four-
    node tetrahedra, four flat ones for each of ten-node ones. `surface` is the same as a TriangleMesh.

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

    def __reduce__(
        self,
    ) -> tuple[Any, ...]:  # copies and worker processes rebuild the connectivity, which is cheap
        return TetMesh, (self.rest_positions, self.tetrahedra, self.parts, self.part_names)

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
            f"{angles[0]:.1f} to {angles[1]:.1f} deg, aspect at most {self.quality.aspects.max():.3g}"
        )

    @classmethod
    def repaired(
        cls,
        rest_positions: Numbers,
        tetrahedra: Numbers,
        parts: Numbers | None = None,
        part_names: dict[str, int] | None = None,
        merge_tolerance: Numbers | None = None,
    ) -> Mended:
        """A mesh of what the constructor would refuse: (mesh, vertex_map, tetrahedron_map, report).

        Vertices nearer than `merge_tolerance` [m] become one (by default none do); tetrahedra that then name a vertex
        twice are left out; inverted ones get two corners exchanged; of those with the same corners the first stays;
        vertices that belong to none are left out. `report` counts each, and `print(report)` says it in words.
        vertex_map (n_v,) and tetrahedron_map (n_t,) lead from the old numbers to the new ones, -1 where one is left out.

        Raises ValueError where that is not enough: flat tetrahedra, overlaps, a surface that touches itself.

        >>> import magshell as ms
        >>> cube = ms.meshes.box((1, 1, 1), cells=(1, 1, 1))
        >>> mended = TetMesh.repaired(cube.rest_positions, cube.tetrahedra[:, [1, 0, 2, 3]])
        >>> print(mended.report)
        6 tetrahedra turned
        """
        return mended(cls, rest_positions, tetrahedra, parts, part_names, merge_tolerance)

    # What it is made of

    @property
    def rest_positions(self) -> np.ndarray:
        """(n_v, 3), m, read-only."""
        return self._rest_positions

    @property
    def tetrahedra(self) -> np.ndarray:
        """(n_t, 4) or (n_t, 10) vertex indices, int32, read-only."""
        return self._tetrahedra

    @property
    def corners(self) -> np.ndarray:
        """(n_t, 4): the first four nodes of each, read-only."""
        return self.tetrahedra[:, :4]

    @property
    def parts(self) -> np.ndarray:
        """(n_t,): the number of the part that each belongs to, int32, read-only."""
        return self._parts

    @property
    def part_names(self) -> dict[str, int]:
        """{name: number}, a copy."""
        return dict(self._part_names)

    @property
    def order(self) -> int:
        """1 for four nodes, 2 for ten."""
        return 1 if self.tetrahedra.shape[1] == 4 else 2

    @property
    def n_tetrahedra(self) -> int:
        """How many there are."""
        return len(self.tetrahedra)

    # Connectivity

    @cached_property
    def _edge_table(self):
        return edge_table(self.corners)

    @property
    def edges(self) -> np.ndarray:
        """(n_e, 2) corners, lower one first, sorted, int32, read-only."""
        return frozen(self._edge_table.edges)

    @property
    def tetrahedron_edges(self) -> np.ndarray:
        """(n_t, 6): the edges 01 12 20 03 13 23 of each, int32, read-only."""
        return frozen(self._edge_table.tetrahedron_edges)

    @cached_property
    def edge_nodes(self) -> np.ndarray:
        """(n_e,): the node on each edge, int32, read-only. ValueError for tetrahedra of four nodes."""
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
        """(n_f, 3) vertex indices: the triangles of the surface, outwards, int32, read-only."""
        return self._triangles[0]

    @property
    def faces_of_corners(self) -> np.ndarray:
        """(n, 3): the corners of each outer side of a tetrahedron, one triangle a side also where there are ten nodes."""
        return self.corners[self._outer[:, None] // 4, FACES[self._outer % 4]]

    @property
    def nodes_of_sides(self) -> np.ndarray:
        """(n, 3) or (n, 6): the nodes of each outer side of a tetrahedron: the corners, then the nodes between the first
        and the second, the second and the third, the third and the first. Of six, side k is faces 4 k to 4 k + 3."""
        nodes = FACES if self.order == 1 else FACE_NODES
        return self.tetrahedra[self._outer[:, None] // 4, nodes[self._outer % 4]]

    @property
    def face_tetrahedra(self) -> np.ndarray:
        """(n_f,): the tetrahedron behind each face, int32, read-only."""
        return self._triangles[1]

    @cached_property
    def surface(self) -> TriangleMesh:
        """The surface as a mesh of its own: its faces are `faces`, its vertices `surface_vertices`."""
        return TriangleMesh(
            self.rest_positions[self.surface_vertices], np.searchsorted(self.surface_vertices, self.faces)
        )

    @cached_property
    def surface_vertices(self) -> np.ndarray:
        """(n_s,): which vertex each vertex of `surface` is, ascending."""
        return frozen(np.unique(self.faces))

    @property
    def boundary_vertices(self) -> np.ndarray:
        """Indices of the vertices on the surface, ascending."""
        return self.surface_vertices

    @cached_property
    def boundary_edges(self) -> np.ndarray:
        """Indices of the edges on the surface, ascending."""
        nodes = self.faces_of_corners.astype(np.int64)
        ends = np.sort(nodes[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
        keys = self.edges[:, 0].astype(np.int64) * self.n_vertices + self.edges[:, 1]
        return frozen(np.searchsorted(keys, np.unique(ends[:, 0] * self.n_vertices + ends[:, 1])))

    @cached_property
    def components(self) -> np.ndarray:
        """(n_v,): the number of the connected piece each vertex belongs to, from 0."""
        piece = groups(self.n_tetrahedra, neighbours(self._face_table))
        of_vertex = np.empty(self.n_vertices, dtype=np.int32)
        of_vertex[self.tetrahedra] = piece[:, None]
        return frozen(of_vertex)

    # Geometry at rest

    @cached_property
    def volumes(self) -> np.ndarray:
        """(n_t,), m3; of ten nodes, of the curved tetrahedra."""
        nodes = self.rest_positions[self.tetrahedra]
        return frozen(straight_volumes(nodes) if self.order == 1 else quadratic_volumes(nodes))

    @property
    def volume(self) -> float:
        """m3."""
        return float(self.volumes.sum())

    @cached_property
    def tetrahedron_barycenters(self) -> np.ndarray:
        """(n_t, 3), m, of the four corners."""
        return frozen(self.rest_positions[self.corners].mean(axis=1))

    @property
    def face_areas(self) -> np.ndarray:
        """(n_f,), m2."""
        return self.surface.face_areas

    @property
    def face_normals(self) -> np.ndarray:
        """(n_f, 3) unit vectors, outwards."""
        return self.surface.face_normals

    @property
    def face_barycenters(self) -> np.ndarray:
        """(n_f, 3), m."""
        return self.surface.face_barycenters

    @cached_property
    def quality(self) -> TetQuality:
        """The shapes of its tetrahedra: dihedral angles, radius ratios, aspects, Jacobians."""
        return TetQuality(self)

    def self_intersections(self, positions: Numbers) -> np.ndarray:
        """The faces of the surface that pass through each other at positions (n_v, 3) m, (k, 2)."""
        return self.surface.self_intersections(np.asarray(positions)[self.surface_vertices])

    # Other meshes from this one

    def with_parts(self, parts: Numbers, names: dict[str, int] | None = None) -> TetMesh:
        """The same mesh with other parts (n_t,), integers or booleans, and names {name: number} for them."""
        return TetMesh(self.rest_positions, self.tetrahedra, parts, names)

    def second_order(self, surface: Projection | None = None) -> TetMesh:
        """The mesh with ten nodes: corners keep their numbers, edge k gets node n_v + k, see `edge_nodes`.

        surface: where curved boundaries are: a signed distance, (n, 3) m -> (n,) m, as those of `ms.shapes`. Nodes on
            edges of the surface move onto it, where both corners lie on it within 1e-3 of the edge; where that would turn
            a tetrahedron inside out, only as far as it does not, of which an ms.MeshQualityWarning says how many and how
            far they stay off it. By default they stay halfway.
        """
        return self if self.order == 2 else quadratic(self, surface)

    def first_order(self) -> TetMesh:
        """The mesh with the corners alone, numbered as they come."""
        return self if self.order == 1 else linear(self)

    def refined(self, surface: Projection | None = None) -> TetMesh:
        """Each tetrahedron divided into eight, at the middle of its edges; they keep their part, 8 t to 8 t + 7.

        Vertices keep their numbers, and edge k gets vertex n_v + k: ten nodes become corners where they are. Repeated,
        it makes no more than three shapes of each tetrahedron. surface: as for `second_order`.
        """
        return refined(self, surface)

    def transformed(self, rotation: Rotates | None = None, translation: Numbers | None = None) -> TetMesh:
        """The mesh moved by x -> rotation x + translation.

        rotation: a (3, 3) matrix or a scipy Rotation. Any invertible matrix will do; under one that mirrors, corners 0
            and 2 of each tetrahedron change places. translation: (3,), m.
        """
        positions = moved(self.rest_positions, rotation, translation)
        tetrahedra = self.tetrahedra
        if straight_volumes(positions[tetrahedra[:1, :4]])[0] < 0:
            tetrahedra = tetrahedra[:, MIRRORED[: tetrahedra.shape[1]]]
        return TetMesh(positions, tetrahedra, self.parts, self.part_names)

    def scaled(self, factor: float) -> TetMesh:
        """The mesh with all coordinates multiplied by a positive factor."""
        positions = self.rest_positions * positive("factor", "", factor)
        return TetMesh(positions, self.tetrahedra, self.parts, self.part_names)
