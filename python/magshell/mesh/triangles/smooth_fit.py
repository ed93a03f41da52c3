"""A smooth surface through the vertices of a fine mesh, and its border: where middle nodes of coarser edges go."""

from __future__ import annotations

import numpy as np
import scipy

from .triangle_mesh import TriangleMesh

_SMOOTH = np.radians(40.0)  # faces that fold by more are a crease, borders that turn by more have a corner
_NEAR = 0.25  # of an edge: how far the surface may be from its middle
_SAME_PLACE = 1e-6  # of an edge
_ENOUGH = 28  # vertices that a polynomial of fourth degree, 15 numbers, is fitted to
_CANDIDATES = 12
_ALONG = 7  # vertices of the border that a curve of fourth degree is fitted to
_POWERS = [(i, d - i) for d in range(5) for i in range(d + 1)]


class SmoothSurface:
    """Of a fine mesh: polynomials of fourth degree over the tangent plane, fitted around each place that is asked for.

    Raises ValueError where the mesh has creases inside.
    """

    def __init__(self, fine: TriangleMesh, name: str):
        self._mesh, self._name = fine, name
        self._refuse_creases()
        n = fine.n_vertices
        ends = np.concatenate([fine.edges, fine.edges[:, ::-1]])
        self._around = scipy.sparse.csr_array((np.ones(len(ends), dtype=bool), tuple(ends.T)), shape=(n, n))
        self._tree = scipy.spatial.cKDTree(fine.rest_positions)
        self._beside: dict[int, list[int]] = {}
        for a, b in fine.edges[fine.boundary_edges].tolist():
            self._beside.setdefault(a, []).append(b)
            self._beside.setdefault(b, []).append(a)

    def _refuse_creases(self) -> None:
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
                f"QuadraticTriangleMesh.of(mesh, place=...)"
            )

    def inside(self, point: np.ndarray, normal: np.ndarray, length: float) -> np.ndarray:
        """(3,): the surface above or below the middle (3,) of an edge, along its normal (3,)."""
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
        """(3,): the border halfway between two of its vertices, on the curve through those nearby, up to corners."""
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
        place = 0.0
        for _ in range(8):
            place -= across(place) / across.deriv()(place)
        return np.polynomial.polynomial.polyval(place, powers)

    def _neighbours(self, vertex: int) -> np.ndarray:
        return self._around.indices[self._around.indptr[vertex] : self._around.indptr[vertex + 1]]

    def _nearest(self, point: np.ndarray, normal: np.ndarray, length: float) -> int:
        """The nearest vertex of the sheet that faces the same way: others may be close by."""
        count = min(_CANDIDATES, self._mesh.n_vertices)
        distances, vertices = (np.atleast_1d(each) for each in self._tree.query(point, k=count))
        facing = self._mesh.vertex_normals[vertices] @ normal > 0.5
        if not facing.any():
            raise self._too_far(point, distances[0])
        return int(vertices[np.argmax(facing)])

    def _too_far(self, point: np.ndarray, distance: float) -> ValueError:
        return ValueError(
            f"{self._name} has no surface that faces the same way near the middle of an edge at {_told(point)} m, the "
            f"nearest is {distance:.3g} m away: the mesh must lie along it, its faces on the same side, and its edges must "
            "be short beside its radii of curvature"
        )

    def _vertex(self, point: np.ndarray, length: float) -> int:
        near = self._tree.query_ball_point(point, _SAME_PLACE * length)
        found = [k for k in near if k in self._beside]
        if not found:
            raise ValueError(
                f"the border of {self._name} has no vertex at {_told(point)} m, where the mesh has one on its border: the "
                "vertices of borders must be some of the finer mesh's"
            )
        return found[0]

    def _chain(self, first: int, last: int) -> list[int]:
        """Vertices of the border from a little before one to a little after another."""
        ways = [way for towards in self._beside[first] if (way := self._way(first, towards, last))]
        if not ways:
            raise ValueError(f"the border of {self._name} has two parts where the mesh has one edge")
        way = min(ways, key=len)
        before, after = self._beyond(way[1], way[0]), self._beyond(way[-2], way[-1])
        return [*reversed(before), *way, *after]

    def _way(self, first: int, towards: int, last: int) -> list[int]:
        """Along the border from one vertex to another; empty if it does not get there."""
        way = [first, towards]
        while way[-1] != last:
            following = [k for k in self._beside[way[-1]] if k != way[-2]]
            if len(following) != 1 or following[0] == first:
                return []
            way.append(following[0])
        return way

    def _beyond(self, before: int, end: int) -> list[int]:
        """What follows beyond an end of a way, up to a corner."""
        found: list[int] = []
        for _ in range(_ALONG // 2):
            following = [k for k in self._beside[end] if k != before]
            if len(following) != 1 or following[0] in found or self._turns(before, end, following[0]):
                break
            before, end = end, following[0]
            found.append(end)
        return found

    def _turns(self, before: int, at: int, after: int) -> bool:
        places = self._mesh.rest_positions
        a, b = places[at] - places[before], places[after] - places[at]
        return float(a @ b) < np.cos(_SMOOTH) * float(np.linalg.norm(a) * np.linalg.norm(b))


def middles_on_fit(mesh: TriangleMesh, fine: TriangleMesh, name: str) -> np.ndarray:
    """(n_e, 3) m: the middles of all edges of a mesh, moved onto the smooth surface of a finer one."""
    surface = SmoothSurface(fine, name)
    middles = np.array(mesh.edge_midpoints)
    normals = mesh.face_normals
    on_border = set(mesh.boundary_edges.tolist())
    for edge, (a, b) in enumerate(mesh.rest_positions[mesh.edges]):
        if edge in on_border:
            middles[edge] = surface.border(a, b)
            continue
        normal = normals[mesh.edge_faces[edge]].sum(axis=0)
        normal /= np.linalg.norm(normal)
        middles[edge] = surface.inside(middles[edge], normal, mesh.edge_lengths[edge])
    return middles


def _axes(normal: np.ndarray) -> np.ndarray:
    """(3, 3): two across, and the normal."""
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across), normal])


def _crossing(off: np.ndarray, arc: np.ndarray) -> float:
    """The length of arc where numbers, which need not grow all the way, first pass through zero from below."""
    k = int(np.argmax((off[:-1] <= 0.0) & (off[1:] > 0.0)))
    return float(arc[k] - off[k] * (arc[k + 1] - arc[k]) / (off[k + 1] - off[k]))


def _told(point: np.ndarray) -> str:
    return f"({', '.join(f'{x:.6g}' for x in point)})"
