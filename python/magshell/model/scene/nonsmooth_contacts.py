"""Finds contacts of bodies that are not smooth: a closest point is about to cross a sharp edge or a border of a
surface.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..contact.contacts_to_core import LARGEST_SMOOTH_TURN
from .contact_state import ContactState

if TYPE_CHECKING:
    from .scene import Scene

_NEXT = np.array([[1, 2], [2, 3], [3, 1]])  # sides of the triangle in a pair (point, three corners)


def near_body_kinks(
    scene: Scene, contact: ContactState, smoothing: float, positions: np.ndarray
) -> np.ndarray:
    """Find the pairs whose closest points are nearer than `smoothing` [m] to a sharp edge or a border.

    An edge is sharp if its faces turn by more than LARGEST_SMOOTH_TURN. positions: (n, 3) m, of all points.
    Returns the vertices (k,) of the first parts of these pairs.
    """
    pairs = contact.pairs[contact.normal_forces > 0.0]
    pairs = pairs[(pairs >= 0).all(axis=1)]
    if not len(pairs):
        return np.zeros(0, dtype=np.int32)
    bodies, n = scene._bodies, len(positions)
    surfaces = [part.shape.faces + bodies.first_on_surface(part) for part in bodies.with_surface_nodes]
    faces = np.concatenate([bodies.original[scene.mesh.faces], *surfaces])
    sharp = _sharp_edges(faces, positions)
    on_face = np.isin(_keys(np.sort(pairs[:, 1:], axis=1), n), _keys(np.sort(faces, axis=1), n))
    found = [_over_sides(pairs[on_face], positions, smoothing, sharp)]
    found.append(_over_ends(pairs[~on_face], positions, smoothing, sharp))
    return np.unique(np.concatenate(found)).astype(np.int32)


def _over_sides(pairs, positions, smoothing, sharp) -> np.ndarray:
    """Return the points (k,) whose projection onto the plane of a triangle is near a sharp side of it."""
    point, corners = positions[pairs[:, 0]], positions[pairs[:, 1:]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    found = []
    for first, second in _NEXT:
        a, b = positions[pairs[:, first]], positions[pairs[:, second]]
        along = b - a
        length = np.linalg.norm(along, axis=1)
        inwards = np.cross(across, along) / length[:, None]
        near = np.abs(np.sum((point - a) * inwards, axis=1)) < smoothing
        distance = np.sum((point - a) * along, axis=1) / length
        near &= (distance > -smoothing) & (distance < length + smoothing)
        is_sharp = np.isin(_keys(np.sort(pairs[:, [first, second]], axis=1), len(positions)), sharp)
        found.append(pairs[near & is_sharp, 0])
    return np.concatenate(found)


def _over_ends(pairs, positions, smoothing, sharp) -> np.ndarray:
    """Return the vertices (k,) of first edges where a closest point of the two (infinite) lines is near an end on a
    sharp edge.
    """
    if not len(pairs):
        return np.zeros(0, dtype=np.int64)
    a, b = (positions[pairs[:, k + 1]] - positions[pairs[:, k]] for k in (0, 2))
    between = positions[pairs[:, 2]] - positions[pairs[:, 0]]
    aa, bb, ab = (np.sum(one * other, axis=1) for one, other in ((a, a), (b, b), (a, b)))
    of_a, of_b = np.sum(a * between, axis=1), np.sum(b * between, axis=1)
    room = aa * bb - ab**2
    crossing = room > 1e-3 * aa * bb
    room = np.where(crossing, room, 1.0)
    closest = ((bb * of_a - ab * of_b) / room, (ab * of_a - aa * of_b) / room)
    ends = np.unique(np.stack([sharp // len(positions), sharp % len(positions)]))
    near = np.zeros(len(pairs), dtype=bool)
    for at, length, first in zip(closest, (np.sqrt(aa), np.sqrt(bb)), (0, 2), strict=True):
        for end, node in ((0.0, first), (1.0, first + 1)):
            near |= (np.abs(at - end) * length < smoothing) & np.isin(pairs[:, node], ends)
    return pairs[near & crossing, :2].ravel()


def _keys(vertices: np.ndarray, n: int) -> np.ndarray:
    """Return one number for each row of vertices, the same for equal rows."""
    return np.ravel_multi_index(tuple(vertices.T.astype(np.int64)), (n,) * vertices.shape[1])


def _sharp_edges(faces: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the sorted keys (k,) of borders and of edges at which faces turn by more than LARGEST_SMOOTH_TURN."""
    x0, x1, x2 = np.moveaxis(positions[faces], 1, 0)
    normals = np.cross(x1 - x0, x2 - x0)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    forwards = ends[:, 0] < ends[:, 1]
    keys, of_face = _keys(np.sort(ends, axis=1), len(positions)), np.tile(np.arange(len(faces)), 3)
    order = np.argsort(keys, kind="stable")
    keys, of_face, forwards = keys[order], of_face[order], forwards[order]
    distinct, first, counts = np.unique(keys, return_index=True, return_counts=True)
    inner = first[counts == 2]
    cosines = np.sum(normals[of_face[inner]] * normals[of_face[inner + 1]], axis=1)
    turned = np.where(forwards[inner] != forwards[inner + 1], cosines, -cosines)
    return np.sort(np.concatenate([distinct[counts != 2], keys[inner[turned < np.cos(LARGEST_SMOOTH_TURN)]]]))
