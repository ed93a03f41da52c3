"""The mesh of six-node triangles: what second-order shells are made of."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..mesh_base import MeshBase, frozen
from ..selection import _where
from ..topology import FLAT
from ..transforms import moved
from .six_node_checks import (
    area_vectors,
    check_elements,
    check_jacobians,
    check_middle_nodes,
    divided,
    edge_lengths,
    shape_integrals,
)
from .smooth_fit import middles_on_fit
from .triangle_mesh import TriangleMesh, checked_mesh

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Rotates


_MIRRORED = [0, 2, 1, 5, 4, 3]


class QuadraticTriangleMesh(MeshBase):
    """An oriented manifold mesh of triangles of six nodes, which may be curved, with or without boundary. Immutable.

    Args:
        rest_positions: (n_v, 3), m.
        elements: (n, 6) vertex indices: the corners, counter-clockwise seen from the side the normal points to, then the
            nodes on the edges 01 12 20. VTK's order and gmsh's.

    Raises:
        ValueError: naming the first offender: what a TriangleMesh of the corners would refuse, nodes on edges that
            neighbours do not share or that are elsewhere too, and nodes so far off the middle that the element is turned
            inside out.

    `faces` are four flat triangles an element, 4 k to 4 k + 3 of element k: those at its corners 0, 1, 2, and the one
    between its middle nodes. They stand for it in contacts, water, pictures and files. `surface` is the same as a
    TriangleMesh; vertices have the same numbers there. `edges` run from corner to corner, `edge_nodes` lie on them. What is
    given for each face of a first-order mesh, as a thickness or a magnetization, is given for each element here.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1), order=2)
    >>> mesh.n_elements, mesh.n_faces, mesh.n_vertices
    (4, 16, 15)
    >>> mesh.vertices_at(x=0.0).tolist(), mesh.edges_at(x=0.0).tolist()
    ([0, 1, 6], [0])
    """

    order = 2

    def __init__(self, rest_positions: Numbers, elements: Numbers):
        positions = quantity("rest_positions", "m", rest_positions, ("n_v", 3))
        nodes = index_array("elements", elements)
        check_elements(nodes, len(positions))
        self._corner_vertices = np.unique(nodes[:, :3])
        self._corners = TriangleMesh(
            positions[self._corner_vertices], np.searchsorted(self._corner_vertices, nodes[:, :3])
        )
        check_middle_nodes(nodes, self._corners.face_edges)
        check_jacobians(positions[nodes])
        self._rest_positions = frozen(positions)
        self._elements = frozen(nodes.astype(np.int32))

    @classmethod
    def of(
        cls, mesh: TriangleMesh, place: Callable[[np.ndarray], np.ndarray] | None = None
    ) -> QuadraticTriangleMesh:
        """The mesh with six nodes of one with three: vertices keep their numbers, edge k gets node n_v + k.

        place: where the surface is: it takes the middles of all edges, (n_e, 3) m, to the points of the surface that are
            to be nodes. Without it edges stay straight, which on a curved surface throws away most of what six nodes are
            for.

        >>> import magshell as ms
        >>> coarse = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(4, 4))
        >>> def outwards(x):
        ...     return x * [1, 0, 1] / np.linalg.norm(x[:, [0, 2]], axis=1, keepdims=True) + x * [0, 1, 0]
        >>> curved = ms.QuadraticTriangleMesh.of(coarse, place=outwards)
        >>> bool(abs(curved.element_areas.sum() - 1.0) < 1e-4)
        True
        """
        mesh = checked_mesh(mesh)
        middles = mesh.edge_midpoints
        if place is not None:
            middles = _placed("place(midpoints)", "n_e", place, middles)
        nodes = mesh.n_vertices + mesh.face_edges[:, [2, 0, 1]]  # edge i is opposite corner i
        return cls(
            np.concatenate([mesh.rest_positions, middles]), np.concatenate([mesh.faces, nodes], axis=1)
        )

    @classmethod
    def fitted(cls, mesh: TriangleMesh, to: TriangleMesh | None = None) -> QuadraticTriangleMesh:
        """The mesh with six nodes of one with three, its new nodes on a smooth surface through the vertices of a finer one.

        For surfaces of which there is a mesh only, from a scan or a program. Around each edge's middle a polynomial of
        fourth degree is fitted to some thirty vertices of `to` that hang together, and along borders a curve up to their
        corners; the middle moves to it across the edge. Vertices stay and keep their numbers, edge k gets node n_v + k.

        to: a mesh of the same sheet, a few times as fine, its faces on the same side; vertices on the border of `mesh` must
            be some of its border's. By default `mesh` itself.

        Raises ValueError where `to` has creases of more than 40 degrees or is not there, and as `of`.

        >>> import magshell as ms
        >>> fine = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(16, 16))
        >>> coarse = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(4, 4))
        >>> radii = np.linalg.norm(ms.QuadraticTriangleMesh.fitted(coarse, to=fine).rest_positions[:, [0, 2]], axis=1)
        >>> bool(abs(radii - 1.0).max() < 1e-6)
        True
        """
        mesh = checked_mesh(mesh)
        name = "mesh" if to is None else "to"
        middles = middles_on_fit(mesh, mesh if to is None else checked_mesh(to, "to"), name)
        return cls.of(mesh, place=lambda _: middles)

    def __reduce__(
        self,
    ) -> tuple[Any, ...]:  # copies and worker processes rebuild the connectivity, which is cheap
        return QuadraticTriangleMesh, (self.rest_positions, self.elements)

    def __repr__(self) -> str:
        extent = " x ".join(f"{length:.4g}" for length in np.ptp(self.rest_positions, axis=0))
        parts = "1 part" if self.n_components == 1 else f"{self.n_components} parts"
        return (
            f"QuadraticTriangleMesh: {self.n_vertices} vertices, {self.n_elements} elements of six nodes, "
            f"{self.n_edges} edges\n"
            f"  size: {extent} m, area {self.element_areas.sum():.4g} m2\n"
            f"  shape: {parts}, {len(self.boundary_edges)} edges on the boundary\n"
            f"  elements: edges {self.edge_lengths.min():.3g} to {self.edge_lengths.max():.3g} m"
        )

    # What it is made of

    @property
    def rest_positions(self) -> np.ndarray:
        """(n_v, 3), m, read-only."""
        return self._rest_positions

    @property
    def elements(self) -> np.ndarray:
        """(n, 6) vertex indices, int32, read-only."""
        return self._elements

    @property
    def n_elements(self) -> int:
        """How many triangles of six nodes there are."""
        return len(self._elements)

    @property
    def corners(self) -> TriangleMesh:
        """The flat mesh of the corners alone; its vertices are `corner_vertices`, edges and faces keep their numbers."""
        return self._corners

    @property
    def corner_vertices(self) -> np.ndarray:
        """Which vertex each vertex of `corners` is, ascending."""
        return frozen(self._corner_vertices)

    # Connectivity

    @cached_property
    def edges(self) -> np.ndarray:
        """(n_e, 2) corners, lower one first, sorted, int32, read-only."""
        return frozen(self._corner_vertices[self._corners.edges].astype(np.int32))

    @cached_property
    def edge_nodes(self) -> np.ndarray:
        """(n_e,): the node on each edge, int32, read-only."""
        nodes = np.empty(self.n_edges, dtype=np.int32)
        nodes[self.element_edges[:, [2, 0, 1]]] = self.elements[:, 3:]
        return frozen(nodes)

    @property
    def element_edges(self) -> np.ndarray:
        """(n, 3): the edge opposite each corner, int32, read-only."""
        return self._corners.face_edges

    @property
    def edge_elements(self) -> np.ndarray:
        """(n_e, 2): the element that runs the edge forward, the one that runs it backward; -1 for none."""
        return self._corners.edge_faces

    @property
    def boundary_edges(self) -> np.ndarray:
        """Indices of the edges with one element, ascending."""
        return self._corners.boundary_edges

    @property
    def interior_edges(self) -> np.ndarray:
        """Indices of the edges with two elements, ascending."""
        return self._corners.interior_edges

    @cached_property
    def boundary_vertices(self) -> np.ndarray:
        """Indices of the vertices on boundary edges, those between corners too, ascending."""
        edges = self.boundary_edges
        return frozen(np.unique(np.concatenate([self.edges[edges].ravel(), self.edge_nodes[edges]])))

    @cached_property
    def components(self) -> np.ndarray:
        """(n_v,): the number of the connected part each vertex belongs to, from 0."""
        of_vertex = np.empty(self.n_vertices, dtype=np.int32)
        of_vertex[self.elements] = self._corners.components[self._corners.faces[:, :1]]
        return frozen(of_vertex)

    @cached_property
    def faces(self) -> np.ndarray:
        """(4 n, 3) vertex indices: four flat triangles an element, int32, read-only."""
        return frozen(np.ascontiguousarray(self.elements[:, FLAT].reshape(-1, 3)))

    @cached_property
    def surface(self) -> TriangleMesh:
        """The flat triangles as a mesh: its faces are `faces`, its vertices these vertices."""
        return TriangleMesh(self.rest_positions, self.faces)

    @property
    def surface_vertices(self) -> np.ndarray:
        """(n_v,): which vertex each vertex of `surface` is: itself."""
        return np.arange(self.n_vertices)

    # Geometry at rest

    @cached_property
    def element_areas(self) -> np.ndarray:
        """(n,), m2, of the curved elements."""
        return frozen(shape_integrals(self.rest_positions[self.elements]).sum(axis=1))

    @cached_property
    def element_centers(self) -> np.ndarray:
        """(n, 3), m: the points of the elements with barycentric coordinates 1/3."""
        nodes = self.rest_positions[self.elements]
        return frozen((4.0 * nodes[:, 3:].sum(axis=1) - nodes[:, :3].sum(axis=1)) / 9.0)

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """(n_e,), m, along the curved edges."""
        return frozen(edge_lengths(self.rest_positions[self.nodes_of_edges]))

    @property
    def nodes_of_edges(self) -> np.ndarray:
        """(n_e, 3): the ends of each edge and the node between them."""
        return np.concatenate([self.edges, self.edge_nodes[:, None]], axis=1)

    @property
    def edge_midpoints(self) -> np.ndarray:
        """(n_e, 3), m: the nodes on the edges."""
        return frozen(self.rest_positions[self.edge_nodes])

    @property
    def face_areas(self) -> np.ndarray:
        """(n_f,), m2, of the flat triangles."""
        return self.surface.face_areas

    @property
    def face_normals(self) -> np.ndarray:
        """(n_f, 3) unit vectors."""
        return self.surface.face_normals

    @property
    def face_barycenters(self) -> np.ndarray:
        """(n_f, 3), m."""
        return self.surface.face_barycenters

    @property
    def element_normals(self) -> np.ndarray:
        """(n, 3) unit vectors, in the mean of each element."""
        vectors = area_vectors(self.rest_positions[self.elements])
        return frozen(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))

    def self_intersections(self, positions: Numbers | None = None) -> np.ndarray:
        """The pairs of flat faces that pass through each other, as those of a TriangleMesh, (k, 2)."""
        return self.surface.self_intersections(positions)

    def edges_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Edges with both ends and the node between them at the given coordinates [m]; see `vertices_at`."""
        return self._at("edge", self.nodes_of_edges, x, y, z, tolerance)

    def elements_where(self, predicate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Elements where predicate((n, 3) centers [m]) -> (n,) bool holds."""
        return _where("element", predicate, self.element_centers, np.arange(self.n_elements))

    # Other meshes from this one

    def first_order(self) -> TriangleMesh:
        """The flat mesh of the corners alone, numbered as they come: `corners`."""
        return self._corners

    def refined(self, place: Callable[[np.ndarray], np.ndarray] | None = None) -> QuadraticTriangleMesh:
        """Each element divided into four, 4 k to 4 k + 3, in the order of `faces`: on the same curved surface.

        Vertices keep their numbers, those on edges become corners, and new ones come after. place: where the surface is, if
            it is another than that of these elements: it takes the new nodes, (m, 3) m, to points of the surface.
        """
        new, elements = divided(self)
        if place is not None:
            new = _placed("place(nodes)", "m", place, new)
        return QuadraticTriangleMesh(np.concatenate([self.rest_positions, new]), elements)

    def flipped(self) -> QuadraticTriangleMesh:
        """The same surface with its normals on the other side; elements and vertices keep their numbers."""
        return QuadraticTriangleMesh(self.rest_positions, self.elements[:, _MIRRORED])

    def transformed(
        self, rotation: Rotates | None = None, translation: Numbers | None = None
    ) -> QuadraticTriangleMesh:
        """The mesh moved by x -> rotation x + translation, as a TriangleMesh is."""
        return QuadraticTriangleMesh(moved(self.rest_positions, rotation, translation), self.elements)

    def scaled(self, factor: float) -> QuadraticTriangleMesh:
        """The mesh with all coordinates multiplied by a positive factor."""
        return QuadraticTriangleMesh(self.rest_positions * positive("factor", "", factor), self.elements)


def _placed(
    name: str, rows: str, place: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> np.ndarray:
    moved_points = quantity(name, "m", place(np.array(points)), (rows, 3))
    if moved_points.shape != points.shape:
        raise ValueError(f"{name} [m] must have shape ({rows}, 3) = {points.shape}, got {moved_points.shape}")
    return moved_points
