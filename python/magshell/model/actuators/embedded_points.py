"""Points that ride on the elements of bodies: where they are at rest, as weights of nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...mesh.topology import EDGES, FLAT
from ...mesh.triangles.six_node_checks import shapes
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ..bodies.bodies import Bodies
from ..rigid.rigid import RigidBody
from ..solids.solid import Solid

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..rigid.equimomental_points import RigidBodyPoints


_OUTSIDE = 1e-6  # of a body's size: a point farther from every element is outside
_STEPS = 30  # of Newton's method, into curved elements
_CANDIDATES = 16  # flat faces, in whose curved elements a point is looked for

# Barycentric coordinates, in an element of six nodes, of the corners of its four flat faces.
_CORNERS_OF_FACES = np.concatenate([np.eye(3), 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))])[
    np.array(FLAT)
]


def riding_points(
    points: Numbers, bodies: Bodies, places: list[RigidBodyPoints]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """points: [(body, (3,) m)]; places: of a scene's rigid parts. Of each, vertices of the scene (then of rigid parts, ten
    each) and weights, which add up to 1. Raises ValueError where a point lies outside its body."""
    found = []
    for k, (body, point) in enumerate(points):
        if isinstance(body, RigidBody):
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


def _on_rigid(part: RigidBody, point: np.ndarray, bodies: Bodies, places) -> tuple[np.ndarray, np.ndarray]:
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
    """Nodes and weights of the nearest face or element, and how far from it the point lies (m)."""
    weights, gaps = _to_faces(body.mesh, point)
    if not isinstance(body.mesh, QuadraticTriangleMesh):
        nearest = int(np.argmin(gaps))
        return body.mesh.faces[nearest], weights[nearest], float(gaps[nearest])
    best = None
    for face in np.argsort(gaps)[
        :_CANDIDATES
    ]:  # flat faces that stand for curved elements lie a little beside them
        nodes = body.mesh.elements[face // 4]
        start = weights[face] @ _CORNERS_OF_FACES[face % 4]
        shares, gap = _onto_curved(body.mesh.rest_positions[nodes], start, point)
        if best is None or gap < best[2]:
            best = (nodes, shares, gap)
    return best


def _onto_curved(positions: np.ndarray, start: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, float]:
    """Weights (6,) of the place of an element (6, 3) that is nearest to the point, by Gauss and Newton's method from
    barycentric coordinates (3,), and how far it is. Outside of the element it is what the element's edges reach."""
    own = start[1:].copy()
    for _ in range(_STEPS):
        shares, slopes = (each[0] for each in shapes(own[None]))
        step = np.linalg.lstsq((slopes @ positions).T, point - shares @ positions, rcond=None)[0]
        own = own + step
        if np.abs(step).max() <= 1e-14:
            break
    inside = np.maximum([own[0], own[1], 1.0 - own.sum()], 0.0)
    shares = shapes((inside[:2] / inside.sum())[None])[0][0]
    return shares, float(np.linalg.norm(point - shares @ positions))


def _to_faces(mesh, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n_f, 3) weights of the foot of the point on each flat face, and how far it lies from them, (n_f,) m."""
    faces = mesh.faces
    a, b, c = np.moveaxis(mesh.rest_positions[faces], 1, 0)
    u, v, w = b - a, c - a, point - a
    uu, uv, vv = (np.sum(x * y, axis=1) for x, y in ((u, u), (u, v), (v, v)))
    wu, wv = np.sum(w * u, axis=1), np.sum(w * v, axis=1)
    determinant = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant
    weights = np.stack([1.0 - s - t, s, t], axis=1)
    above = np.linalg.norm(w - s[:, None] * u - t[:, None] * v, axis=1)
    gaps = above + np.maximum(-weights.min(axis=1), 0.0) * np.sqrt(np.maximum(uu, vv))
    return weights, gaps
