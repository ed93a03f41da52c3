"""Finds what is inside of solids with an own field and which edges coincide, and refuses other bodies of it there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ...mesh.connected import connected_groups
from ...mesh.triangles.winding_numbers import winding_numbers
from ..solids.solid import Solid
from .own_field import bodies_with_own_field
from .own_field_errors import COINCIDE, are_sources_together

if TYPE_CHECKING:
    from ..bodies.bodies import Bodies
    from .scene import Scene
    from .values import Values

# [-] Winding number beyond which a point is inside: 1/2 on a face, 1/4 on an edge of a cube, up to 3/4 on an edge that
# points inwards; fixed by test_bodies_that_reach_into_a_solid_are_refused
_INSIDE = 0.9
_MOST_NAMED = 4  # largest number of vertices in the message
_ALONG = 1e-9  # [-] sine of the angle below which a magnetization is along an edge, where it makes no charge or current


def check_magnets_apart(values: Values, state: np.ndarray) -> None:
    """Raise ValueError if bodies with an own field overlap in the start of a solve, as describe_overlap() says."""
    if reason := describe_overlap(values, state):
        raise ValueError(f"the start cannot be: {reason}")


def describe_overlap(values: Values, state: np.ndarray) -> str:
    """Return a clause for a message that names vertices of a body inside of a solid, or edges that coincide; "" if there
    are none.
    """
    scene = values.scene
    if scene.own_field is None or not np.isfinite(state).all():
        return ""
    positions = scene._model.positions(state)
    return _describe_vertices_inside(scene, positions) or _describe_coincident_edges(values, state, positions)


def _describe_vertices_inside(scene: Scene, positions: np.ndarray) -> str:
    chosen = _numbers(scene)
    for k in chosen:
        for other in chosen:
            if other == k or not isinstance(scene.bodies[k], Solid):
                continue
            points = positions[scene._bodies.spans[other].vertices]
            inside = np.flatnonzero(_is_inside(scene, k, positions, points))
            if len(inside):
                vertices = ", ".join(map(str, inside[:_MOST_NAMED]))
                more = ", ..." if len(inside) > _MOST_NAMED else ""
                return (
                    f"{len(inside)} vertices ({vertices}{more}) of body {other} are inside of body {k}, "
                    f"{scene.bodies[k]!r:.80}. In the own field the magnetization of both would be there. Move them apart, "
                    "keep them apart by a Contact, or leave one of them out of ms.OwnField(bodies=...)"
                )
    return ""


def _describe_coincident_edges(values: Values, state: np.ndarray, positions: np.ndarray) -> str:
    """Return a clause that names edges with magnetic charges or currents that coincide, though nothing ties them.

    The forces between them are infinite.
    """
    bodies = values.scene._bodies
    found = [pair for k in _numbers(values.scene) for pair in _slits(values, k, positions)]
    between = _edges_between_bodies(values.scene, positions)
    if len(between) and are_sources_together(values, state):
        found += [*between]
    if not found:
        return ""
    named = "; ".join(
        f"{_named_edge(bodies, first)} and {_named_edge(bodies, second)}"
        for first, second in found[:_MOST_NAMED]
    )
    more = "; ..." if len(found) > _MOST_NAMED else ""
    many = "pairs of edges coincide" if len(found) > 1 else "pair of edges coincides"
    return (
        f"{len(found)} {many}: {named}{more}. In the own field the forces between them are infinite. Tie them (ms.Tie, or "
        "ms.weld), leave a gap of a part of the edges' length between them, or leave a body out of "
        "ms.OwnField(bodies=...)"
    )


def _named_edge(bodies: Bodies, ends: np.ndarray) -> str:
    k = next(k for k, span in enumerate(bodies.spans) if ends[0] < span.vertices.stop)
    first, last = (ends[[0, -1]] - bodies.spans[k].vertices.start).tolist()
    return f"that of vertices {first} and {last} of body {k}"


def _edges_between_bodies(scene: Scene, positions: np.ndarray) -> np.ndarray:
    """Return pairs of edges on the surfaces of two bodies that are at the same place and not tied together.

    (n, 2, 2), the vertices of the scene at the ends of both.
    """
    spans = [scene._bodies.spans[k] for k in _numbers(scene)]
    corners = [span.mesh.faces + span.vertices.start for span in spans]
    edges = np.concatenate([np.zeros((0, 3), dtype=int), *corners])[:, [[0, 1], [1, 2], [2, 0]]].reshape(
        -1, 2
    )
    _, once = np.unique(np.sort(scene._bodies.original[edges], axis=1), axis=0, return_index=True)
    edges = edges[np.sort(once)]
    body = np.searchsorted([span.vertices.stop for span in scene._bodies.spans], edges[:, 0], side="right")
    pairs = _coincident_pairs(edges, positions, COINCIDE * scene._bodies.extent)
    return edges[pairs[body[pairs[:, 0]] != body[pairs[:, 1]]]]


def _slits(values: Values, number: int, positions: np.ndarray) -> np.ndarray:
    """Return pairs of edges on the border of a shell with magnetic charges or currents that are at the same place.

    (n, 2, k), the vertices of the scene along both.
    """
    scene, body = values.scene, values.scene.bodies[number]
    span = scene._bodies.spans[number]
    mesh = span.mesh
    if isinstance(body, Solid):
        return np.zeros((0, 2, 2), dtype=int)
    beside = mesh.edge_faces if mesh.order == 1 else mesh.edge_elements
    border = np.flatnonzero((beside < 0).any(axis=1))
    label = next(label for each, label in scene._labels if each is body)
    magnetization = scene._value_layout.of(values.numbers, label, "remanent_magnetization")
    magnetization = np.broadcast_to(magnetization, (mesh.n_elements, 3))[beside[border].max(axis=1)]
    along = mesh.rest_positions[mesh.edges[border]]
    across = np.linalg.norm(np.cross(magnetization, along[:, 1] - along[:, 0]), axis=1)
    sizes = np.linalg.norm(magnetization, axis=1) * mesh.edge_lengths[border]
    nodes = (mesh.edges if mesh.order == 1 else mesh.nodes_of_edges)[border[across > _ALONG * sizes]]
    nodes = nodes + span.vertices.start
    original = np.sort(scene._bodies.original[nodes], axis=1)
    pairs = _coincident_pairs(nodes, positions, COINCIDE * scene._bodies.extent)
    return nodes[pairs[(original[pairs[:, 0]] != original[pairs[:, 1]]).any(axis=1)]]


def _coincident_pairs(sides: np.ndarray, positions: np.ndarray, tolerance: float) -> np.ndarray:
    """Return pairs (n, 2) of sides (m, k), vertices of the scene, that are in the same place within a tolerance [m]."""
    vertices, at = np.unique(sides, return_inverse=True)
    near = scipy.spatial.cKDTree(positions[vertices]).query_pairs(tolerance, output_type="ndarray")
    if not len(near):
        return np.zeros((0, 2), dtype=int)
    place = np.sort(connected_groups(len(vertices), near)[at.reshape(sides.shape)], axis=1)
    order = np.lexsort(place.T)
    same = np.flatnonzero((place[order][1:] == place[order][:-1]).all(axis=1))
    return np.stack([order[same], order[same + 1]], axis=1)


def are_in_solids(scene: Scene, positions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) m are inside of a solid with an own field, (n,); positions: (n_v, 3) m."""
    inside = np.zeros(len(points), dtype=bool)
    for k in _numbers(scene):
        if isinstance(scene.bodies[k], Solid) and scene.bodies[k].remanent_magnetization is not None:
            inside |= _is_inside(scene, k, positions, points)
    return inside


def _numbers(scene: Scene) -> list[int]:
    """Return the numbers of the shells and solids with an own field."""
    named = bodies_with_own_field(scene)
    return [k for k, body in enumerate(scene.bodies) if any(body is each for each in named)]


def _is_inside(scene: Scene, number: int, positions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which points (n, 3) m are inside of a solid, (n,)."""
    span = scene._bodies.spans[number]
    corners = positions[span.vertices][span.mesh.faces]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    inside = ((points > low) & (points < high)).all(axis=1)
    inside[inside] = winding_numbers(points[inside], corners) > _INSIDE
    return inside
