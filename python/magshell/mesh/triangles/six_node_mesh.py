"""Mesh of six-node (quadratic) triangles, which may be curved, for shells of second order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..._input.selections import Indices
from ..groups import renumbered
from ..mesh_base import MeshBase, frozen
from ..off_surface import warn_of_straight_edges
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


_REVERSED = [0, 2, 1, 5, 4, 3]  # order of the nodes of an element whose normal is reversed


class QuadraticTriangleMesh(MeshBase):
    """An oriented manifold mesh of six-node triangles, which may be curved, with or without boundary. Immutable.

    Its vertices are corners and midside nodes together. An edge runs from corner to corner; `edge_nodes` has the midside
    node of each edge. A face is one of four flat triangles that represent an element in contact, water, pictures and files:
    faces 4 k to 4 k + 2 are at the corners 0, 1, 2 of element k, face 4 k + 3 is between its midside nodes. `surface` is
    the TriangleMesh of the faces. Quantities that are given per face for a first-order mesh, such as thickness or
    magnetization, are given per element here.

    Args:
        rest_positions: (n_v, 3), m.
        elements: (n, 6) vertex indices: the corners, counter-clockwise seen from the side the normal points to, then the
            midside nodes on the edges 01, 12, 20, in the order of VTK and gmsh.

    Raises:
        ValueError: if a TriangleMesh of the corners would be refused, if two elements with a common edge have different
            midside nodes on it, if a midside node is used anywhere else as well, or if midside nodes are so far from the
            middle of their edges that the Jacobian determinant of an element is not positive. The message names the first
            such node or element.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1), order=2)
    >>> mesh.n_elements, mesh.n_faces, mesh.n_vertices
    (4, 16, 15)
    >>> mesh.vertices_at(x=0.0).tolist(), mesh.edges_at(x=0.0).tolist()
    ([0, 1, 6], [0])
    """

    order = 2

    def __init__(self, rest_positions: Numbers, elements: Numbers):
        vars(self).update(_checked_attributes(rest_positions, elements))
        warn_of_straight_edges(self._corners, self.edge_midpoints)

    @classmethod
    def _without_warning(cls, rest_positions: Numbers, elements: Numbers) -> QuadraticTriangleMesh:
        """Make a mesh derived from an existing one, without warning of straight edges again."""
        mesh = object.__new__(cls)
        vars(mesh).update(_checked_attributes(rest_positions, elements))
        return mesh

    @classmethod
    def from_triangles(
        cls,
        mesh: TriangleMesh,
        project: Callable[[np.ndarray], np.ndarray] | None = None,
        *,
        surface: TriangleMesh | None = None,
    ) -> QuadraticTriangleMesh:
        """Build a six-node mesh from a three-node one.

        Vertices keep their positions and numbers. The midside node of edge k of `mesh` gets the number n_v + k. Without
        `project` and `surface` the edges stay straight. On a curved surface most of the accuracy of six nodes is then lost;
        a MeshQualityWarning says so if the angles between faces are those of a smooth surface.

        project: a function that maps the midpoints of all edges, (n_e, 3) m, to points on the curved surface, the midside
            nodes.
        surface: a mesh of the same surface, a few times as fine, with normals on the same side; the boundary vertices of
            `mesh` must be boundary vertices of it. `mesh` itself where there is no finer one. Use it for a surface that is
            known only as a mesh, from a scan or another program. Around the midpoint of each inner edge a polynomial of
            fourth degree is fitted to about thirty connected vertices of `surface`; the midpoint moves along the normal onto
            the fit. For a boundary edge a curve of fourth degree is fitted to the boundary vertices nearby, but not beyond
            corners of the boundary; the midpoint moves perpendicular to the edge onto this curve.

        Raises ValueError if both are given, if `project` does not return one finite point an edge, or if `surface` has
        creases of more than 40 degrees or nothing near an edge of `mesh`.

        >>> import magshell as ms
        >>> coarse = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(4, 4))
        >>> def outwards(x):
        ...     return x * [1, 0, 1] / np.linalg.norm(x[:, [0, 2]], axis=1, keepdims=True) + x * [0, 1, 0]
        >>> curved = ms.QuadraticTriangleMesh.from_triangles(coarse, project=outwards)
        >>> bool(abs(curved.element_areas.sum() - 1.0) < 1e-4)
        True
        >>> fine = ms.meshes.cylinder(1.0, 1.0, angle=1.0, cells=(16, 16))
        >>> fitted = ms.QuadraticTriangleMesh.from_triangles(coarse, surface=fine)
        >>> radii = np.linalg.norm(fitted.rest_positions[:, [0, 2]], axis=1)
        >>> bool(abs(radii - 1.0).max() < 1e-6)
        True
        """
        mesh = checked_mesh(mesh)
        if project is not None and surface is not None:
            raise ValueError("give project= or surface=, not both: each says where the midside nodes lie")
        middles = mesh.edge_midpoints
        if project is not None:
            middles = projected("project(midpoints)", "n_e", project, middles)
        elif surface is not None:
            middles = middles_on_fit(
                mesh, checked_mesh(surface, "surface"), "mesh" if surface is mesh else "surface"
            )
        nodes = mesh.n_vertices + mesh.face_edges[:, [2, 0, 1]]  # edge i is opposite corner i
        mesh._warn_of_new_vertices()
        positions = np.concatenate([mesh.rest_positions, middles])
        return cls(positions, np.concatenate([mesh.faces, nodes], axis=1))._with_members(mesh._groups)

    # A copy or a pickle stores positions and elements only; the connectivity is computed again, which is cheap.
    def __reduce__(self) -> tuple[Any, ...]:
        made_from = (self.rest_positions, self.elements)
        return QuadraticTriangleMesh._without_warning, made_from, self._groups_state()

    def __repr__(self) -> str:
        extent = " x ".join(f"{length:.4g}" for length in np.ptp(self.rest_positions, axis=0))
        parts = "1 part" if self.n_components == 1 else f"{self.n_components} parts"
        return (
            f"QuadraticTriangleMesh: {self.n_vertices} vertices, {self.n_elements} elements of six nodes, "
            f"{self.n_edges} edges\n"
            f"  size: {extent} m, area {self.element_areas.sum():.4g} m2\n"
            f"  shape: {parts}, {len(self.boundary_edges)} edges on the boundary\n"
            f"  elements: edges {self.edge_lengths.min():.3g} to {self.edge_lengths.max():.3g} m{self._groups_text()}"
        )

    # Nodes and elements

    @property
    def rest_positions(self) -> np.ndarray:
        """The positions of the vertices in the reference configuration, (n_v, 3) m, read-only."""
        return self._rest_positions

    @property
    def elements(self) -> np.ndarray:
        """The vertex indices of each element, (n, 6) int32, read-only."""
        return self._elements

    @property
    def n_elements(self) -> int:
        """The number of six-node triangles."""
        return len(self._elements)

    @property
    def corners(self) -> TriangleMesh:
        """The flat three-node mesh of the corners, with a face per element.

        Its faces and edges have the numbers of the elements and edges here; its vertex k is vertex `corner_vertices[k]`.
        """
        return self._corners

    @property
    def corner_vertices(self) -> np.ndarray:
        """The vertex of this mesh that each vertex of `corners` is, ascending."""
        return frozen(self._corner_vertices)

    # Connectivity

    @cached_property
    def edges(self) -> np.ndarray:
        """The corners at the ends of each edge, (n_e, 2) int32, lower one first, sorted, read-only."""
        return frozen(self._corner_vertices[self._corners.edges].astype(np.int32))

    @cached_property
    def edge_nodes(self) -> np.ndarray:
        """The midside node of each edge, (n_e,) int32, read-only."""
        nodes = np.empty(self.n_edges, dtype=np.int32)
        nodes[self.element_edges[:, [2, 0, 1]]] = self.elements[:, 3:]
        return frozen(nodes)

    @property
    def element_edges(self) -> np.ndarray:
        """The edge opposite each corner of the elements, (n, 3) int32, read-only."""
        return self._corners.face_edges

    @property
    def edge_elements(self) -> np.ndarray:
        """The two elements at each edge, (n_e, 2), -1 for none.

        Counter-clockwise, the first element has the edge from its lower to its higher vertex, the second the other way.
        """
        return self._corners.edge_faces

    @property
    def boundary_edges(self) -> np.ndarray:
        """The indices of the edges with one element, ascending."""
        return self._corners.boundary_edges

    @property
    def interior_edges(self) -> np.ndarray:
        """The indices of the edges with two elements, ascending."""
        return self._corners.interior_edges

    @cached_property
    def boundary_vertices(self) -> np.ndarray:
        """The indices of the vertices on boundary edges, midside nodes included, ascending."""
        edges = self.boundary_edges
        return frozen(np.unique(np.concatenate([self.edges[edges].ravel(), self.edge_nodes[edges]])))

    @cached_property
    def components(self) -> np.ndarray:
        """The number, from 0, of the connected part that each vertex belongs to, (n_v,)."""
        of_vertex = np.empty(self.n_vertices, dtype=np.int32)
        of_vertex[self.elements] = self._corners.components[self._corners.faces[:, :1]]
        return frozen(of_vertex)

    @cached_property
    def faces(self) -> np.ndarray:
        """The vertex indices of the flat triangles, four per element, (4 n, 3) int32, read-only."""
        return frozen(np.ascontiguousarray(self.elements[:, FLAT].reshape(-1, 3)))

    @cached_property
    def surface(self) -> TriangleMesh:
        """The flat triangles `faces` as a TriangleMesh, with the same vertex numbers."""
        return TriangleMesh(self.rest_positions, self.faces)._with_members(self._surface_groups())

    @property
    def surface_vertices(self) -> np.ndarray:
        """The vertex of this mesh that each vertex of `surface` is: 0, 1, ..., n_v - 1."""
        return np.arange(self.n_vertices)

    # Geometry of the reference configuration

    @cached_property
    def element_areas(self) -> np.ndarray:
        """The areas of the curved elements, (n,) m2."""
        return frozen(shape_integrals(self.rest_positions[self.elements]).sum(axis=1))

    @cached_property
    def element_centers(self) -> np.ndarray:
        """The centers of the curved elements, where all barycentric coordinates are 1/3, (n, 3) m."""
        nodes = self.rest_positions[self.elements]
        return frozen((4.0 * nodes[:, 3:].sum(axis=1) - nodes[:, :3].sum(axis=1)) / 9.0)

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """The lengths of the curved edges, (n_e,) m."""
        return frozen(edge_lengths(self.rest_positions[self.nodes_of_edges]))

    @property
    def nodes_of_edges(self) -> np.ndarray:
        """The nodes on each edge, (n_e, 3): its two ends, then its midside node."""
        return np.concatenate([self.edges, self.edge_nodes[:, None]], axis=1)

    @property
    def edge_midpoints(self) -> np.ndarray:
        """The positions of the midside nodes, (n_e, 3) m."""
        return frozen(self.rest_positions[self.edge_nodes])

    @property
    def face_areas(self) -> np.ndarray:
        """The areas of the flat triangles, (n_f,) m2."""
        return self.surface.face_areas

    @property
    def face_normals(self) -> np.ndarray:
        """The unit normals of the flat triangles, (n_f, 3)."""
        return self.surface.face_normals

    @property
    def face_barycenters(self) -> np.ndarray:
        """The barycenters of the flat triangles, (n_f, 3) m."""
        return self.surface.face_barycenters

    @property
    def element_normals(self) -> np.ndarray:
        """The mean normals of the curved elements as unit vectors, (n, 3)."""
        vectors = area_vectors(self.rest_positions[self.elements])
        return frozen(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))

    def self_intersections(self, positions: Numbers | None = None) -> np.ndarray:
        """Find the pairs of flat faces that pass through each other, (k, 2); see `TriangleMesh.self_intersections`."""
        return self.surface.self_intersections(positions)

    def edges_at(
        self,
        x: Numbers | None = None,
        y: Numbers | None = None,
        z: Numbers | None = None,
        tolerance: float | None = None,
    ) -> np.ndarray:
        """Select the edges with both ends and the midside node at the given coordinates [m]; see `vertices_at`."""
        return self._at("edge", self.nodes_of_edges, x, y, z, tolerance)

    def elements_in(self, group: str | Sequence[str]) -> np.ndarray:
        """Select the elements of a named group of faces, or of several. Raises ValueError if there are none."""
        return Indices(self._sides_in(group), "elements of six nodes")

    @property
    def _corners_of_sides(self) -> np.ndarray:
        return self.elements[:, :3]

    @property
    def _middle_nodes(self) -> np.ndarray | None:
        return self.edge_nodes

    def elements_where(self, predicate: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Select the elements for which `predicate` is True; it maps centers (n, 3) [m] to booleans (n,)."""
        return _where("element", predicate, self.element_centers, np.arange(self.n_elements))

    # Modified meshes

    def first_order(self) -> TriangleMesh:
        """Return the flat mesh of the corners, `corners` with the groups of this mesh."""
        numbers = np.full(self.n_vertices, -1)
        numbers[self._corner_vertices] = np.arange(len(self._corner_vertices))
        return (
            self._corners._with_members(renumbered(self._groups, numbers)) if self._groups else self._corners
        )

    def refined(self, project: Callable[[np.ndarray], np.ndarray] | None = None) -> QuadraticTriangleMesh:
        """Return the mesh with each element divided into four: element k into 4 k to 4 k + 3, in the order of `faces`.

        Vertices keep their numbers, the midside nodes become corners, and the new midside nodes follow, on the curved
        elements. project: a function that maps the new nodes, (m, 3) m, to points on another surface.
        """
        new, elements = divided(self)
        if project is not None:
            new = projected("project(nodes)", "m", project, new)
        fine = self._without_warning(np.concatenate([self.rest_positions, new]), elements)
        return fine._with_members(self._refined_groups())

    def flipped(self) -> QuadraticTriangleMesh:
        """Return the same surface with reversed normals; elements and vertices keep their numbers."""
        reverse = self._without_warning(self.rest_positions, self.elements[:, _REVERSED])
        return reverse._with_members(self._groups)

    def transformed(
        self, rotation: Rotates | None = None, translation: Numbers | None = None
    ) -> QuadraticTriangleMesh:
        """Return the mesh transformed by x -> rotation x + translation; see `TriangleMesh.transformed`."""
        positions = moved(self.rest_positions, rotation, translation)
        return self._without_warning(positions, self.elements)._with_members(self._groups)

    def _with_rest_positions(self, rest_positions: np.ndarray) -> QuadraticTriangleMesh:
        """Return the same elements at other rest positions (n_v, 3) m."""
        return self._without_warning(rest_positions, self.elements)._with_members(self._groups)

    def scaled(self, factor: float) -> QuadraticTriangleMesh:
        """Return the mesh with all coordinates multiplied by a positive factor."""
        positions = self.rest_positions * positive("factor", "", factor)
        return self._without_warning(positions, self.elements)._with_members(self._groups)


def _checked_attributes(rest_positions: Numbers, elements: Numbers) -> dict[str, Any]:
    """Check the arguments of QuadraticTriangleMesh and return the attributes that it stores. Raises its ValueErrors."""
    positions = quantity("rest_positions", "m", rest_positions, ("n_v", 3))
    nodes = index_array("elements", elements)
    check_elements(nodes, len(positions))
    numbers = np.unique(nodes[:, :3])
    corners = TriangleMesh(positions[numbers], np.searchsorted(numbers, nodes[:, :3]))
    check_middle_nodes(nodes, corners.face_edges)
    check_jacobians(positions[nodes])
    return {
        "_corner_vertices": frozen(numbers),
        "_corners": corners,
        "_rest_positions": frozen(positions),
        "_elements": frozen(nodes.astype(np.int32)),
    }


def projected(
    name: str, rows: str, project: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> np.ndarray:
    """Return project(points), (n, 3) m, after a check of its shape.

    name, rows: what error messages call the result, and its number of rows.
    """
    moved_points = quantity(name, "m", project(np.array(points)), (rows, 3))
    if moved_points.shape != points.shape:
        raise ValueError(f"{name} [m] must have shape ({rows}, 3) = {points.shape}, got {moved_points.shape}")
    return moved_points
