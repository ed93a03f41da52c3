"""The edges of bodies that pictures show as lines: borders and sharp edges from every side, and silhouettes for one eye.

A silhouette is a part of an edge of a closed surface behind which there is nothing, or something farther away.
"""

from __future__ import annotations

import numpy as np

from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State

# [-] Cosine of the angle between the normals of two faces in the reference configuration; an edge with a larger angle is
# drawn as a crease. On closed surfaces the angle is larger, since coarse meshes of round bodies have large angles as well.
CREASE = np.cos(np.radians(40.0))
SOLID_CREASE = np.cos(np.radians(65.0))


def outline(mesh: TriangleMesh) -> np.ndarray:
    """Return the edges to draw as lines from every side, (k, 2): borders, and creases of the rest shape."""
    return mesh.edges[outline_edges(mesh)]


def outline_edges(mesh: TriangleMesh) -> np.ndarray:
    """Return the numbers of the edges of the outline, ascending.

    Creases of a closed surface that end somewhere are left out: on coarse meshes of round bodies they are fragments.
    """
    interior = mesh.interior_edges
    normals = mesh.face_normals[mesh.edge_faces[interior]]
    cosine = np.einsum("ei,ei->e", normals[:, 0], normals[:, 1])
    closed = of_closed(mesh)[interior]
    sharp = interior[closed & (cosine < SOLID_CREASE)]
    creases = interior[~closed & (cosine < CREASE)]
    return np.sort(np.concatenate([mesh.boundary_edges, creases, sharp[_without_ends(mesh.edges[sharp])]]))


def seen(state: State, edges: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return those of the edges (k,) that are not on the far side of a closed surface.

    Lines are lifted towards the eye, so those on the far side would be visible through the surface.
    """
    mesh = state.mesh
    hidden = of_closed(mesh)[edges] & ~towards_eye(state, eye)[mesh.edge_faces[edges]].any(axis=1)
    return edges[~hidden]


def of_closed(mesh: TriangleMesh) -> np.ndarray:
    """Return whether each edge belongs to a connected part without boundary, (n_e,) bool."""
    of_edge = mesh.components[mesh.edges[:, 0]]
    return ~np.isin(of_edge, of_edge[mesh.boundary_edges])


def towards_eye(state: State, eye: np.ndarray) -> np.ndarray:
    """Return whether the outer side of each face is towards the eye, (n_f,) bool; for closed surfaces."""
    mesh = state.mesh
    x0, x1, x2 = np.moveaxis(state.positions[mesh.faces], 1, 0)
    piece = mesh.components[mesh.faces[:, 0]]
    # volumes of the connected parts, negative if normals point inwards
    volumes = np.bincount(piece, np.einsum("fi,fi->f", x0, np.cross(x1, x2)))
    return np.cross(x1 - x0, x2 - x0) @ eye * np.sign(volumes)[piece] > 0


def _without_ends(edges: np.ndarray) -> np.ndarray:
    """Return whether each edge (k, 2) is left after edges with a free end have been removed, again and again, (k,) bool."""
    left = np.ones(len(edges), dtype=bool)
    while True:
        count = np.bincount(edges[left].ravel(), minlength=edges.max(initial=-1) + 1)
        still = left & (count[edges] > 1).all(axis=1)
        if (still == left).all():
            return left
        left = still


PARTS = 4  # number of parts of an edge, each of which is shown or hidden
# [-] Distances over the mean edge length. A point this far outside an edge on the screen shows what is behind the edge.
ASIDE = 0.05
# A surface behind an edge that is nearer to it than this belongs to a fold, and the edge is no outline; fixed by
# test_edges_in_front_of_a_near_surface_are_no_silhouettes.
GAP = 0.5


def silhouettes(state: State, eye: np.ndarray) -> np.ndarray:
    """Return the parts of edges of closed surfaces that are outlines for the direction (3,) of the eye, (k, 2, 3) m.

    Behind such a part the next surface is farther away than GAP allows, or there is none.
    """
    mesh, edges = state.mesh, turning_edges(state, eye)
    if not len(edges):
        return np.zeros((0, 2, 3))
    step = float(mesh.edge_lengths.mean())
    start, end = np.moveaxis(state.positions[mesh.edges[edges]], 1, 0)
    ends = start + np.linspace(0.0, 1.0, PARTS + 1)[:, None, None] * (end - start)
    middles = 0.5 * (ends[1:] + ends[:-1]) @ _axes(eye).T
    points = middles[:, :, :2] + ASIDE * step * _outwards(state, edges, eye)
    behind = _depths(state.positions[mesh.faces] @ _axes(eye).T, points.reshape(-1, 2))
    shown = middles[:, :, 2] - behind.reshape(middles.shape[:2]) > GAP * step
    return np.stack([ends[:-1][shown], ends[1:][shown]], axis=1)


def turning_edges(state: State, eye: np.ndarray) -> np.ndarray:
    """Return the numbers of the edges of closed surfaces between a face towards the eye and one away from it."""
    mesh, interior = state.mesh, state.mesh.interior_edges
    closed = interior[of_closed(mesh)[interior]]
    towards = towards_eye(state, eye)[mesh.edge_faces[closed]]
    return closed[towards[:, 0] != towards[:, 1]]


def _axes(eye: np.ndarray) -> np.ndarray:
    """Return a matrix (3, 3) whose rows are two unit vectors that span the screen, and the direction of the eye."""
    right = np.cross(np.eye(3)[np.argmin(np.abs(eye))], eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def _outwards(state: State, edges: np.ndarray, eye: np.ndarray) -> np.ndarray:
    """Return unit vectors (k, 2) on the screen that are perpendicular to edges and point away from their faces."""
    mesh = state.mesh
    ends = state.positions[mesh.edges[edges]] @ _axes(eye).T
    along = (ends[:, 1] - ends[:, 0])[:, :2]
    across = along[:, ::-1] * (-1.0, 1.0) / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    faces = state.positions[mesh.faces[mesh.edge_faces[edges]]].mean(axis=2) @ _axes(eye).T
    inwards = ((faces - ends.mean(axis=1, keepdims=True))[:, :, :2] * across[:, None]).sum(axis=(1, 2))
    return -np.sign(inwards)[:, None] * across


def _depths(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how far towards the eye the nearest triangle is at each point (k, 2) m of the screen, (k,) m; -inf without one.

    triangles: corners (m, 3, 3) m along the rows of `_axes`, so that a larger third coordinate is nearer to the eye.
    """
    point, triangle = _near(triangles[:, :, :2], points)
    a, b, c = np.moveaxis(triangles[triangle], 1, 0)
    one, other, offset = (b - a)[:, :2], (c - a)[:, :2], points[point] - a[:, :2]
    area = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    # Triangles seen edge-on cover nothing: their quotients are not finite.
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = (offset[:, 0] * other[:, 1] - offset[:, 1] * other[:, 0]) / area
        t = (one[:, 0] * offset[:, 1] - one[:, 1] * offset[:, 0]) / area
        inside = (area != 0.0) & (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0)
        depths = a[:, 2] + s * (b - a)[:, 2] + t * (c - a)[:, 2]
    found = np.full(len(points), -np.inf)
    np.maximum.at(found, point[inside], depths[inside])
    return found


def _near(triangles: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices (p,) of points, and of triangles (m, 3, 2), that share a cell of a grid on the screen.

    The cells are as large as the largest triangle, so that a triangle touches four of them at most.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    cell = float((high - low).max())
    first, last = (np.floor((each - low.min(axis=0)) / cell).astype(np.int64) for each in (low, high))
    width = int(last[:, 0].max()) + 2
    corners = [np.where([right, up], last, first) @ (1, width) for right in (0, 1) for up in (0, 1)]
    key, triangle = np.unique(
        np.stack([np.concatenate(corners), np.tile(np.arange(len(triangles)), 4)], axis=1), axis=0
    ).T
    place = np.floor((points - low.min(axis=0)) / cell).astype(np.int64)
    of_point = np.where((place >= 0).all(axis=1) & (place[:, 0] < width), place @ (1, width), -1)
    begin, end = np.searchsorted(key, of_point, "left"), np.searchsorted(key, of_point, "right")
    count = end - begin
    entry = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + np.repeat(begin, count)
    return np.repeat(np.arange(len(points)), count), triangle[entry]
