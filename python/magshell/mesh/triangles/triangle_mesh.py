"""The mesh of three-node triangles: rest positions, faces, connectivity and geometry."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._input.arrays import index_array
from ..._input.quantity import quantity
from ..._input.scalars import positive
from ..connected import connected_groups
from ..mesh_base import MeshBase, frozen
from ..signed_distance import Distance, middles_on_surface
from ..transforms import moved
from .face_quality import MeshQuality

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Rotates


# nodes of a face: 0 to 2 are its corners, 3 to 5 the midpoints of the edges opposite to them
_CHILDREN = np.array([(0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5)])


class TriangleMesh(MeshBase):
    """An oriented manifold triangle mesh, with or without boundary, of one or several connected parts. Immutable.

    Args:
        rest_positions: (n_v, 3), m.
        faces: (n_f, 3) vertex indices, counter-clockwise seen from the side the normal points to.

    Raises:
        ValueError: for coordinates that are not finite, indices out of range, degenerate or repeated faces, edges with more
            than two faces, neighbours of opposite orientation, and unused vertices. The message names the first of them.

    Edge i of a face is opposite its vertex i. Edges run from lower to higher vertex and are sorted.

    >>> TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).edges.tolist()
    [[0, 1], [0, 2], [1, 2]]
    """

    def __init__(self, rest_positions: Numbers, faces: Numbers):
        self._core = _core.TriangleMesh(
            quantity("rest_positions", "m", rest_positions, ("n_v", 3)), index_array("faces", faces)
        )

    # Copies and worker processes compute the connectivity again, which is cheap.
    def __reduce__(self) -> tuple[Any, ...]:
        return TriangleMesh, (self.rest_positions, self.faces), self._groups_state()

    def __repr__(self) -> str:
        return summary(self)

    order = 1

    # Connectivity

    @cached_property
    def rest_positions(self) -> np.ndarray:
        """The positions of the vertices in the reference configuration, (n_v, 3) m, read-only."""
        return self._core.rest_positions

    @cached_property
    def faces(self) -> np.ndarray:
        """The vertex indices of each face, (n_f, 3) int32, read-only."""
        return self._core.faces

    @property
    def elements(self) -> np.ndarray:
        """The elements, which have a thickness and a magnetization each: here the same as `faces`."""
        return self.faces

    @property
    def nodes_of_edges(self) -> np.ndarray:
        """The nodes on each edge, (n_e, 2): here its ends only."""
        return self.edges

    @property
    def n_elements(self) -> int:
        """The number of elements, here that of faces."""
        return self.n_faces

    @cached_property
    def edges(self) -> np.ndarray:
        """The vertex indices of each edge, (n_e, 2) int32, lower one first, sorted, read-only."""
        return self._core.edges

    @cached_property
    def edge_faces(self) -> np.ndarray:
        """The two faces at each edge, (n_e, 2), -1 for none.

        The first face runs the edge from its lower to its higher vertex, the second face the other way.
        """
        return self._core.edge_faces

    @cached_property
    def face_edges(self) -> np.ndarray:
        """The edge opposite each vertex of the faces, (n_f, 3) int32, read-only."""
        return self._core.face_edges

    @cached_property
    def boundary_edges(self) -> np.ndarray:
        """The indices of the edges with one face, ascending."""
        return frozen(np.flatnonzero((self.edge_faces < 0).any(axis=1)))

    @cached_property
    def interior_edges(self) -> np.ndarray:
        """The indices of the edges with two faces, ascending."""
        return frozen(np.flatnonzero((self.edge_faces >= 0).all(axis=1)))

    @cached_property
    def boundary_vertices(self) -> np.ndarray:
        """The indices of the vertices on boundary edges, ascending."""
        return frozen(np.unique(self.edges[self.boundary_edges]))

    @cached_property
    def boundary_loops(self) -> tuple[np.ndarray, ...]:
        """The vertices of each closed boundary curve, in order, with the surface on the left."""
        return tuple(map(frozen, boundary_loops(self)))

    @cached_property
    def components(self) -> np.ndarray:
        """The number, from 0, of the connected part that each vertex belongs to, (n_v,)."""
        return frozen(connected_groups(self.n_vertices, self.edges))

    # Geometry of the reference configuration

    @cached_property
    def _area_vectors(self) -> np.ndarray:
        return self._area_vectors_at(self.rest_positions)

    def _area_vectors_at(self, positions: np.ndarray) -> np.ndarray:
        x0, x1, x2 = np.moveaxis(positions[self.faces], 1, 0)
        return 0.5 * np.cross(x1 - x0, x2 - x0)

    @cached_property
    def face_areas(self) -> np.ndarray:
        """The areas of the faces, (n_f,) m2."""
        return frozen(np.linalg.norm(self._area_vectors, axis=1))

    @property
    def element_areas(self) -> np.ndarray:
        """The areas of the elements, here the faces, (n_f,) m2."""
        return self.face_areas

    @cached_property
    def face_normals(self) -> np.ndarray:
        """The unit normals of the faces, (n_f, 3)."""
        return frozen(self._area_vectors / self.face_areas[:, None])

    @cached_property
    def face_barycenters(self) -> np.ndarray:
        """The barycenters of the faces, (n_f, 3) m."""
        return frozen(self.rest_positions[self.faces].mean(axis=1))

    @cached_property
    def vertex_normals(self) -> np.ndarray:
        """The unit normals at the vertices, (n_v, 3): area-weighted means of the faces' normals; zero where these cancel."""
        return frozen(self.normals_at_vertices(self.rest_positions))

    def normals_at_vertices(self, positions: np.ndarray) -> np.ndarray:
        """Compute the vertex normals (n_v, 3) of the mesh with its vertices at other positions, (n_v, 3) m."""
        corners, areas = self.faces.ravel(), self._area_vectors_at(positions)
        total = np.stack([np.bincount(corners, np.repeat(area, 3)) for area in areas.T], axis=1)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.divide(total, length, out=np.zeros_like(total), where=length > 0)

    @cached_property
    def quality(self) -> MeshQuality:
        """The quality of the faces: angles, aspect ratios, heights. A Shell's `quality` knows the thickness as well."""
        return MeshQuality(self)

    # Geometry of other configurations

    def self_intersections(self, positions: Numbers | None = None) -> np.ndarray:
        """Find the pairs of faces that pass through each other, (k, 2), lower number first, sorted.

        positions: (n_v, 3), m; by default the rest positions. Faces that share an edge are never listed; faces that share a
        vertex are, if they intersect away from it. Faces that only touch do not count: overlaps below 1e-12 of the mesh's
        size are taken as touching, unless the surface passes through there. The search takes about 1 microsecond per face.

        >>> mesh = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -1], [0.3, 0.3, 1], [1, 1, 1]],
        ...     [[0, 1, 2], [3, 4, 5]])
        >>> mesh.self_intersections().tolist()
        [[0, 1]]
        """
        if positions is None:
            return self._core.self_intersections(self.rest_positions)
        array = quantity("positions", "m", positions, ("n_v", 3))
        if len(array) != self.n_vertices:
            raise ValueError(
                f"positions [m] must have shape (n_v, 3) = ({self.n_vertices}, 3), got {array.shape}"
            )
        return self._core.self_intersections(array)

    # Modified meshes

    def flipped(self) -> TriangleMesh:
        """Return the same surface with reversed normals; faces and vertices keep their numbers."""
        return TriangleMesh(self.rest_positions, self.faces[:, [0, 2, 1]])._with_members(self._groups)

    def refined(self, surface: Distance | None = None) -> TriangleMesh:
        """Return the mesh with each face divided into four, 4 f to 4 f + 3, at the midpoints of its edges.

        Vertices keep their numbers, and the midpoint of edge k is vertex n_v + k. surface: a signed distance in m,
        (n, 3) -> (n,), such as an ms.shapes.Shape. The midpoints of edges whose ends lie on it are moved onto it; by default
        they stay on the straight edges.
        """
        return refined(self, surface)

    def transformed(
        self, rotation: Rotates | None = None, translation: Numbers | None = None
    ) -> TriangleMesh:
        """Return the mesh transformed by x -> rotation x + translation.

        Args:
            rotation: a (3, 3) matrix or a scipy Rotation. Any invertible matrix is allowed. The faces keep their vertex
                order, so under a matrix that mirrors, the normals end up on the other side of the mirrored surface.
            translation: (3,), m.
        """
        positions = moved(self.rest_positions, rotation, translation)
        return TriangleMesh(positions, self.faces)._with_members(self._groups)

    def _with_rest_positions(self, rest_positions: np.ndarray) -> TriangleMesh:
        """Return the same faces with other rest positions (n_v, 3) m."""
        return TriangleMesh(rest_positions, self.faces)._with_members(self._groups)

    def scaled(self, factor: float) -> TriangleMesh:
        """Return the mesh with all coordinates multiplied by a positive factor."""
        positions = self.rest_positions * positive("factor", "", factor)
        return TriangleMesh(positions, self.faces)._with_members(self._groups)


def checked_mesh(value: Any, name: str = "mesh") -> TriangleMesh:
    """Return the value, or raise ValueError, which calls it `name`, if it is not a TriangleMesh."""
    if not isinstance(value, TriangleMesh):
        raise ValueError(f"{name} must be a TriangleMesh, got {type(value).__name__}")
    return value


def refined(mesh: TriangleMesh, surface: Distance | None) -> TriangleMesh:
    """Return the refined mesh, in which face f becomes the faces 4 f to 4 f + 3.

    Vertices keep their numbers, and the midpoint of edge k is vertex n_v + k. surface: a signed distance onto whose zeros
    midpoints are moved, or None.
    """
    middles = mesh.edge_midpoints
    if surface is not None:
        edges, on_it = middles_on_surface(mesh, np.arange(mesh.n_edges), surface)
        middles = middles.copy()
        middles[edges] = on_it
    nodes = np.concatenate([mesh.faces, mesh.n_vertices + mesh.face_edges], axis=1)
    fine = type(mesh)(np.concatenate([mesh.rest_positions, middles]), nodes[:, _CHILDREN].reshape(-1, 3))
    return fine._with_members(mesh._refined_groups())


def summary(mesh: TriangleMesh) -> str:
    """Describe a mesh in four lines: counts, size, topology and quality of its faces."""
    extent = np.ptp(mesh.rest_positions, axis=0)
    parts = "1 part" if mesh.n_components == 1 else f"{mesh.n_components} parts"
    loops = [len(loop) for loop in mesh.boundary_loops]
    if not loops:
        boundary = "closed"
    elif len(loops) == 1:
        boundary = f"1 boundary loop of {loops[0]} edges"
    else:
        boundary = f"{len(loops)} boundary loops of {min(loops)} to {max(loops)} edges"
    quality = mesh.quality
    return (
        f"TriangleMesh: {mesh.n_vertices} vertices, {mesh.n_faces} faces, {mesh.n_edges} edges\n"
        f"  size: {' x '.join(f'{length:.4g}' for length in extent)} m, area {mesh.face_areas.sum():.4g} m2\n"
        f"  shape: {parts}, {boundary}\n"
        f"  faces: edges {mesh.edge_lengths.min():.3g} to {mesh.edge_lengths.max():.3g} m, "
        f"angles {np.degrees(quality.smallest_angles.min()):.1f} to "
        f"{np.degrees(quality.largest_angles.max()):.1f} deg, aspect at most {quality.aspects.max():.3g}"
        f"{mesh._groups_text()}"
    )


def boundary_loops(mesh: TriangleMesh) -> list[np.ndarray]:
    """Return the vertices of each boundary curve, in the direction of its faces, beginning at its lowest boundary edge."""
    starts = {}  # boundary edge -> the vertex its face leaves
    for edge in mesh.boundary_edges:
        forward = mesh.edge_faces[edge, 0] >= 0
        starts[int(edge)] = int(mesh.edges[edge, 0 if forward else 1])
    loops, seen = [], set()
    for first in starts:
        loop, edge = [], first
        while edge not in seen:
            seen.add(edge)
            loop.append(starts[edge])
            edge = _next_boundary_edge(mesh, edge)
        if loop:
            loops.append(np.array(loop))
    return loops


def _next_boundary_edge(mesh, edge: int) -> int:
    """Return the boundary edge that follows in its loop.

    The search rotates about the common vertex from face to face, so that several fans of faces at a vertex stay separate.
    """
    face = int(mesh.edge_faces[edge].max())
    while True:
        corner = int(np.flatnonzero(mesh.face_edges[face] == edge)[0])
        edge = int(mesh.face_edges[face, (corner + 1) % 3])
        here, there = mesh.edge_faces[edge]
        if here < 0 or there < 0:
            return edge
        face = int(there if here == face else here)
