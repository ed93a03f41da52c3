"""Smooth surfaces fitted to the vertices of a fine mesh, onto which midside nodes of a coarser mesh are moved."""

from __future__ import annotations

import numpy as np
import scipy

from ..off_surface import CREASE
from .triangle_mesh import TriangleMesh

# [rad] A larger angle between the normals of adjacent faces is a crease; between boundary edges, a corner.
_SMOOTH = CREASE
_NEAR = 0.25  # [-] largest distance of the surface from the middle of an edge, relative to its length
_SAME_PLACE = 1e-6  # [-] largest distance between equal vertices, relative to the edge's length
_ENOUGH = 28  # vertices to which a polynomial of fourth degree, with 15 coefficients, is fitted
_CANDIDATES = 12  # nearest vertices among which one on a face of the same orientation is sought
_ALONG = 7  # boundary vertices to which a curve of fourth degree is fitted
_POWERS = [(i, d - i) for d in range(5) for i in range(d + 1)]


class SmoothSurface:
    """A smooth surface through the vertices of a fine mesh, fitted locally by polynomials over the tangent plane.

    At each requested point a polynomial of fourth degree is fitted to the vertices around it.
    Raises ValueError if the mesh has creases inside.
    """

    def __init__(self, fine: TriangleMesh, name: str):
        self._mesh, self._name = fine, name
        self._refuse_creases()
        n = fine.n_vertices
        ends = np.concatenate([fine.edges, fine.edges[:, ::-1]])
        self._around = scipy.sparse.csr_array((np.ones(len(ends), dtype=bool), tuple(ends.T)), shape=(n, n))
        self._tree = scipy.spatial.cKDTree(fine.rest_positions)
        self._border_neighbours: dict[int, list[int]] = {}
        for a, b in fine.edges[fine.boundary_edges].tolist():
            self._border_neighbours.setdefault(a, []).append(b)
            self._border_neighbours.setdefault(b, []).append(a)

    def _refuse_creases(self) -> None:
        """Raise ValueError if the normals of two adjacent faces differ by more than _SMOOTH."""
        fine = self._mesh
        sides = fine.face_normals[fine.edge_faces[fine.interior_edges]]
        cosines = np.einsum("ki,ki->k", sides[:, 0], sides[:, 1])
        if len(cosines) and cosines.min() < np.cos(_SMOOTH):
            edge = fine.interior_edges[np.argmin(cosines)]
            fold = np.degrees(np.arccos(np.clip(cosines.min(), -1.0, 1.0)))
            raise ValueError(
                f"{self._name} folds by {fold:.0f} degrees at its edge {edge}, from vertex {fine.edges[edge][0]} to "
                f"{fine.edges[edge][1]}: a smooth surface is fitted where faces turn by at most "
                f"{np.degrees(_SMOOTH):.0f} from one to the next. Take a finer mesh, or "
                f"QuadraticTriangleMesh.from_triangles(mesh, project=...)"
            )

    def inside(self, point: np.ndarray, normal: np.ndarray, length: float) -> np.ndarray:
        """Return the point (3,) of the surface above or below the middle of an interior edge.

        point: (3,) m, the middle of the edge. normal: (3,), the unit normal there. length: m, that of the edge.
        """
        start = self._nearest(point, normal, length)
        members, ring = {start}, [start]
        while ring and len(members) < _ENOUGH:
            ring = list({int(k) for v in ring for k in self._neighbours(v)} - members)
            members.update(ring)
        axes = _axes(normal)
        local = (self._mesh.rest_positions[sorted(members)] - point) @ axes.T
        size = np.linalg.norm(local[:, :2], axis=1).max()
        u, v = local[:, :2].T / size
        powers = _POWERS if len(local) >= 20 else _POWERS[:6] if len(local) >= 8 else _POWERS[:3]
        weights = np.exp(-(u**2) - v**2)
        table = np.stack([weights * u**i * v**j for i, j in powers], axis=1)
        height = np.linalg.lstsq(table, weights * local[:, 2], rcond=None)[0][0]
        if not abs(height) <= _NEAR * length:
            raise self._too_far(point, abs(height))
        return point + height * axes[2]

    def border(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the point (3,) of the boundary curve halfway between two of its vertices, (3,) m each.

        The curve is fitted to the boundary vertices nearby, not beyond corners.
        """
        length = float(np.linalg.norm(last - first))
        chain = self._chain(self._vertex(first, length), self._vertex(last, length))
        points = self._mesh.rest_positions[chain]
        middle, along = 0.5 * (first + last), (last - first) / length
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        off = (points - middle) @ along
        at = _crossing(off, arc)
        near = np.sort(np.argsort(np.abs(arc - at))[:_ALONG])
        s = (arc[near] - at) / length
        powers = np.polynomial.polynomial.polyfit(s, points[near], min(4, len(near) - 1))
        curve = np.polynomial.Polynomial
        across = curve((powers - middle * (np.arange(len(powers)) == 0)[:, None]) @ along)
        root = 0.0
        for _ in range(8):
            root -= across(root) / across.deriv()(root)
        return np.polynomial.polynomial.polyval(root, powers)

    def _neighbours(self, vertex: int) -> np.ndarray:
        return self._around.indices[self._around.indptr[vertex] : self._around.indptr[vertex + 1]]

    def _nearest(self, point: np.ndarray, normal: np.ndarray, length: float) -> int:
        """Return the nearest vertex with a normal on the same side; another part of the shell may be close by."""
        count = min(_CANDIDATES, self._mesh.n_vertices)
        distances, vertices = (np.atleast_1d(each) for each in self._tree.query(point, k=count))
        facing = self._mesh.vertex_normals[vertices] @ normal > 0.5
        if not facing.any():
            raise self._too_far(point, distances[0])
        return int(vertices[np.argmax(facing)])

    def _too_far(self, point: np.ndarray, distance: float) -> ValueError:
        return ValueError(
            f"{self._name} has no surface with its normal on the same side near the middle of an edge at "
            f"{_format_point(point)} m; the nearest is {distance:.3g} m away. The mesh must lie along it, with its normals "
            "on the same side, and its edges must be short compared with the radii of curvature"
        )

    def _vertex(self, point: np.ndarray, length: float) -> int:
        """Return the boundary vertex at a point (3,) m, or raise ValueError. length: m, that of the edge that ends there."""
        near = self._tree.query_ball_point(point, _SAME_PLACE * length)
        found = [k for k in near if k in self._border_neighbours]
        if not found:
            raise ValueError(
                f"the border of {self._name} has no vertex at {_format_point(point)} m, where the mesh has one: the border "
                "vertices of the mesh must be border vertices of the finer one as well"
            )
        return found[0]

    def _chain(self, first: int, last: int) -> list[int]:
        """Return the boundary vertices from a little before one vertex to a little after another."""
        paths = [
            p for towards in self._border_neighbours[first] if (p := self._border_path(first, towards, last))
        ]
        if not paths:
            raise ValueError(f"the border of {self._name} has two parts where the mesh has one edge")
        path = min(paths, key=len)
        before, after = self._beyond(path[1], path[0]), self._beyond(path[-2], path[-1])
        return [*reversed(before), *path, *after]

    def _border_path(self, first: int, towards: int, last: int) -> list[int]:
        """Return the vertices along the boundary from one vertex to another, or [] if they are not connected that way."""
        path = [first, towards]
        while path[-1] != last:
            following = [k for k in self._border_neighbours[path[-1]] if k != path[-2]]
            if len(following) != 1 or following[0] == first:
                return []
            path.append(following[0])
        return path

    def _beyond(self, before: int, end: int) -> list[int]:
        """Return a few boundary vertices that follow after `end`, up to a corner; `before` precedes it."""
        found: list[int] = []
        for _ in range(_ALONG // 2):
            following = [k for k in self._border_neighbours[end] if k != before]
            if len(following) != 1 or following[0] in found or self._is_corner(before, end, following[0]):
                break
            before, end = end, following[0]
            found.append(end)
        return found

    def _is_corner(self, before: int, at: int, after: int) -> bool:
        """Return whether the boundary bends by more than _SMOOTH at a vertex between two others."""
        positions = self._mesh.rest_positions
        a, b = positions[at] - positions[before], positions[after] - positions[at]
        return float(a @ b) < np.cos(_SMOOTH) * float(np.linalg.norm(a) * np.linalg.norm(b))


def middles_on_fit(
    mesh: TriangleMesh, fine: TriangleMesh, name: str, edges: np.ndarray | None = None
) -> np.ndarray:
    """Return the midpoints of edges of a mesh, moved onto the smooth surface of a finer one, (k, 3) m.

    name: what error messages call the finer mesh. edges: (k,), by default all.
    """
    surface = SmoothSurface(fine, name)
    chosen = np.arange(mesh.n_edges) if edges is None else edges
    middles = np.array(mesh.edge_midpoints[chosen])
    normals = mesh.face_normals
    on_border = set(mesh.boundary_edges.tolist())
    for k, edge in enumerate(chosen.tolist()):
        if edge in on_border:
            middles[k] = surface.border(*mesh.rest_positions[mesh.edges[edge]])
            continue
        normal = normals[mesh.edge_faces[edge]].sum(axis=0)
        normal /= np.linalg.norm(normal)
        middles[k] = surface.inside(middles[k], normal, mesh.edge_lengths[edge])
    return middles


def _axes(normal: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis (3, 3) whose last row is the normal."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across), normal])


def _crossing(off: np.ndarray, arc: np.ndarray) -> float:
    """Return the arc length at which the values `off` first change from negative to positive, by linear interpolation."""
    k = int(np.argmax((off[:-1] <= 0.0) & (off[1:] > 0.0)))
    return float(arc[k] - off[k] * (arc[k + 1] - arc[k]) / (off[k + 1] - off[k]))


def _format_point(point: np.ndarray) -> str:
    return f"({', '.join(f'{x:.6g}' for x in point)})"
