"""Points that ride on the elements of bodies: where they are at rest, as weights of nodes."""

from __future__ import annotations

import numpy as np

from ..bodies.bodies import Bodies
from ..bodies.rigid import Rigid
from ..bodies.solid import Solid
from ..mesh.tet_topology import EDGES

_OUTSIDE = 1e-6  # of a body's size: a point farther from every element is outside
_STEPS = 30  # of Newton's method, into curved elements


def riding_points(points, bodies: Bodies, places) -> list[tuple[np.ndarray, np.ndarray]]:
    """points: [(body, (3,) m)]; places: of a scene's rigid parts. Of each, vertices of the scene (then of rigid parts, ten
    each) and weights, which add up to 1. Raises ValueError where a point lies outside its body."""
    found = []
    for k, (body, point) in enumerate(points):
        if isinstance(body, Rigid):
            found.append(_on_rigid(body, point, bodies, places))
            continue
        vertices, weights, gap = _in_solid(body, point) if isinstance(body, Solid) else _on_shell(body, point)
        if not gap <= _OUTSIDE * body.mesh.size:
            raise ValueError(
                f"point {k} of the Tendon, {np.round(point, 9).tolist()} m, lies outside every element of its body, "
                f"{gap:.3g} m from the nearest"
            )
        span = bodies.spans[bodies.number(body)]
        found.append((bodies.original[span.vertices][vertices], weights))
    return [_once(*each) for each in found]


def _once(vertices: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without those that have no weight."""
    kept = np.abs(weights) > 1e-12
    return vertices[kept], weights[kept]


def _on_rigid(part: Rigid, point: np.ndarray, bodies: Bodies, places) -> tuple[np.ndarray, np.ndarray]:
    """Of the four corners of its own points, wherever it is."""
    k = bodies.rigid_number(part)
    corners = places[k].rest[:4]
    system = np.concatenate([corners.T, np.ones((1, 4))])
    weights = np.linalg.solve(system, np.append(point, 1.0))
    return len(bodies.original) + 10 * k + np.arange(4), weights


def _in_solid(body: Solid, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Nodes, weights, and how far outside the nearest element it lies (m)."""
    mesh, nodes = body.mesh, body.mesh.tetrahedra
    corners = mesh.rest_positions[nodes[:, :4]]
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2)
    inside = np.linalg.solve(edges, (point - corners[:, 0])[..., None])[..., 0]
    coordinates = np.concatenate([1.0 - inside.sum(axis=1, keepdims=True), inside], axis=1)
    heights = 1.0 / np.linalg.norm(np.linalg.inv(edges), axis=2).max(axis=1)
    gaps = np.maximum(-coordinates.min(axis=1), 0.0) * heights
    if nodes.shape[1] == 4:
        nearest = int(np.argmin(gaps))
        return nodes[nearest], coordinates[nearest], float(gaps[nearest])
    best = None
    for element in np.argsort(gaps)[:8]:  # curved elements reach a little beyond the plane ones
        own = _curved_coordinates(mesh.rest_positions[nodes[element]], coordinates[element], point)
        gap = float(max(-own.min(), 0.0) * heights[element])
        if best is None or gap < best[2]:
            best = (nodes[element], _ten_shapes(own)[0], gap)
        if gap == 0.0:
            break
    return best


def _curved_coordinates(positions: np.ndarray, start: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(4,), which add up to 1, of a point in an element of ten nodes (10, 3)."""
    own = start.copy()
    for _ in range(_STEPS):
        shapes, slopes = _ten_shapes(own)
        rest = point - shapes @ positions
        if np.abs(rest).max() <= 1e-14 * np.abs(positions).max():
            break
        jacobian = positions.T @ slopes  # (3, 4)
        step = np.linalg.solve(jacobian[:, 1:] - jacobian[:, :1], rest)
        own = own + np.concatenate([[-step.sum()], step])
    return own


def _ten_shapes(coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(10,) at four coordinates, and their slopes (10, 4)."""
    slopes = np.zeros((10, 4))
    slopes[:4] = np.diag(4.0 * coordinates - 1.0)
    for k, (a, b) in enumerate(EDGES):
        slopes[4 + k, a], slopes[4 + k, b] = 4.0 * coordinates[b], 4.0 * coordinates[a]
    of_edges = 4.0 * coordinates[EDGES[:, 0]] * coordinates[EDGES[:, 1]]
    return np.concatenate([coordinates * (2.0 * coordinates - 1.0), of_edges]), slopes


def _on_shell(body, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Of the nearest face, and how far from it."""
    faces = body.mesh.faces
    a, b, c = np.moveaxis(body.mesh.rest_positions[faces], 1, 0)
    u, v, w = b - a, c - a, point - a
    uu, uv, vv = (np.sum(x * y, axis=1) for x, y in ((u, u), (u, v), (v, v)))
    wu, wv = np.sum(w * u, axis=1), np.sum(w * v, axis=1)
    determinant = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant
    weights = np.stack([1.0 - s - t, s, t], axis=1)
    above = np.linalg.norm(w - s[:, None] * u - t[:, None] * v, axis=1)
    gaps = above + np.maximum(-weights.min(axis=1), 0.0) * np.sqrt(np.maximum(uu, vv))
    nearest = int(np.argmin(gaps))
    return faces[nearest], weights[nearest], float(gaps[nearest])
