"""Points embedded in elements of bodies: rest positions as weighted sums of nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...mesh.topology import EDGES, FLAT
from ...mesh.triangles.six_node_checks import shapes
from ...mesh.triangles.six_node_mesh import QuadraticTriangleMesh
from ..rigid.rigid import RigidBody
from ..solids.solid import Solid
from .bodies import Bodies

if TYPE_CHECKING:
    from ..rigid.equimomental_points import RigidBodyPoints


_OUTSIDE = 1e-6  # [-] of a body's size: a point farther from every element is outside
_STEPS = 30  # largest number of Newton steps to the coordinates in a curved element
_CANDIDATES = 16  # number of nearest flat faces whose curved elements are searched for a point

# Barycentric coordinates, in an element of six nodes, of the corners of its four flat faces.
_CORNERS_OF_FACES = np.concatenate([np.eye(3), 0.5 * (np.eye(3) + np.roll(np.eye(3), 1, axis=1))])[
    np.array(FLAT)
]


def embed_points(
    points: Sequence[tuple[Any, np.ndarray]],
    bodies: Bodies,
    rigid_points: Sequence[RigidBodyPoints],
    owner: str = "Tendon",
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the nodes and weights of each point; the weights add up to 1.

    points: [(body, (3,) m)]. rigid_points: of the scene's rigid bodies. owner: whose points they are, for messages.
    Nodes are vertices of the scene, followed by the points of rigid bodies, ten each. Raises ValueError if a point lies
    outside its body.
    """
    found = []
    for k, (body, point) in enumerate(points):
        if isinstance(body, RigidBody):
            found.append(_on_rigid(body, point, bodies, rigid_points))
            continue
        vertices, weights, gap = _in_solid(body, point) if isinstance(body, Solid) else _on_shell(body, point)
        if not gap <= _OUTSIDE * body.mesh.size:
            raise ValueError(
                f"point {k} of the {owner}, {np.round(point, 9).tolist()} m, lies outside every element of its body, "
                f"{gap:.3g} m from the nearest"
            )
        span = bodies.spans[bodies.number(body)]
        found.append((bodies.original[span.vertices][vertices], weights))
    return [_without_zeros(*each) for each in found]


def embedded_in(body: Any, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices of a Shell or Solid in whose element a point (3,) m lies, and their weights."""
    vertices, weights, _ = _in_solid(body, point) if isinstance(body, Solid) else _on_shell(body, point)
    return vertices, weights


def moved_with(body: Any, now: Any, point: np.ndarray) -> np.ndarray:
    """Return where a point (3,) m of a body lies in the same body with other rest positions, `now`.

    Points of rigid bodies stay, as do the points that stand for their inertia.
    """
    if isinstance(body, RigidBody):
        return point
    vertices, weights = embedded_in(body, point)
    return point + weights @ (now.mesh.rest_positions[vertices] - body.mesh.rest_positions[vertices])


def _without_zeros(vertices: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes that have a weight, and their weights."""
    nonzero = np.abs(weights) > 1e-12
    return vertices[nonzero], weights[nonzero]


def _on_rigid(
    part: RigidBody, point: np.ndarray, bodies: Bodies, rigid_points
) -> tuple[np.ndarray, np.ndarray]:
    """Return the four corners of a rigid body's points and their weights, wherever the point is."""
    k = bodies.rigid_number(part)
    corners = rigid_points[k].rest[:4]
    system = np.concatenate([corners.T, np.ones((1, 4))])
    weights = np.linalg.solve(system, np.append(point, 1.0))
    return len(bodies.original) + 10 * k + np.arange(4), weights


def _in_solid(body: Solid, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the nodes and weights of a point in a solid, and its distance outside the nearest element, m."""
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
    for element in np.argsort(gaps)[:8]:  # curved elements extend a little beyond the plane ones
        own = _curved_coordinates(mesh.rest_positions[nodes[element]], coordinates[element], point)
        gap = float(max(-own.min(), 0.0) * heights[element])
        if best is None or gap < best[2]:
            best = (nodes[element], _ten_shapes(own)[0], gap)
        if gap == 0.0:
            break
    return best


def _curved_coordinates(positions: np.ndarray, start: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the barycentric coordinates (4,) of a point in an element of ten nodes (10, 3), by Newton's method."""
    own = start.copy()
    for _ in range(_STEPS):
        shapes, slopes = _ten_shapes(own)
        residual = point - shapes @ positions
        if np.abs(residual).max() <= 1e-14 * np.abs(positions).max():
            break
        jacobian = positions.T @ slopes  # (3, 4)
        step = np.linalg.solve(jacobian[:, 1:] - jacobian[:, :1], residual)
        own = own + np.concatenate([[-step.sum()], step])
    return own


def _ten_shapes(coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape functions (10,) at four barycentric coordinates, and their derivatives (10, 4)."""
    slopes = np.zeros((10, 4))
    slopes[:4] = np.diag(4.0 * coordinates - 1.0)
    for k, (a, b) in enumerate(EDGES):
        slopes[4 + k, a], slopes[4 + k, b] = 4.0 * coordinates[b], 4.0 * coordinates[a]
    of_edges = 4.0 * coordinates[EDGES[:, 0]] * coordinates[EDGES[:, 1]]
    return np.concatenate([coordinates * (2.0 * coordinates - 1.0), of_edges]), slopes


def _on_shell(body, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the nodes and weights of the nearest point of a shell, and its distance, m."""
    weights, gaps = _to_faces(body.mesh, point)
    if not isinstance(body.mesh, QuadraticTriangleMesh):
        nearest = int(np.argmin(gaps))
        return body.mesh.faces[nearest], weights[nearest], float(gaps[nearest])
    best = None
    # The flat faces of a curved element lie a little off it, so that several candidates are needed.
    for face in np.argsort(gaps)[:_CANDIDATES]:
        nodes = body.mesh.elements[face // 4]
        start = weights[face] @ _CORNERS_OF_FACES[face % 4]
        values, gap = _onto_curved(body.mesh.rest_positions[nodes], start, point)
        if best is None or gap < best[2]:
            best = (nodes, values, gap)
    return best


def _onto_curved(positions: np.ndarray, start: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the weights (6,) of the nearest point of a six-node element (6, 3), and its distance, m.

    The Gauss-Newton method starts from barycentric coordinates (3,). A result outside the element is clipped to its edges.
    """
    own = start[1:].copy()
    for _ in range(_STEPS):
        values, slopes = (each[0] for each in shapes(own[None]))
        step = np.linalg.lstsq((slopes @ positions).T, point - values @ positions, rcond=None)[0]
        own = own + step
        if np.abs(step).max() <= 1e-14:
            break
    inside = np.maximum([own[0], own[1], 1.0 - own.sum()], 0.0)
    values = shapes((inside[:2] / inside.sum())[None])[0][0]
    return values, float(np.linalg.norm(point - values @ positions))


def _to_faces(mesh, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the weights (n_f, 3) of a point's projection onto each flat face, and its distances from the faces, (n_f,)
    m.
    """
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
