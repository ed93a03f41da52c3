"""Surfaces of springs and elastic foundations, and the edges of creases, for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ...model.loads.foundation import ElasticFoundation
from ...model.loads.spring import Spring
from ...model.loads.springs import Springs
from .link_surfaces import joined

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult
    from ...model.scene.scene import Scene

Surface = tuple[np.ndarray, np.ndarray]

_COIL = 0.012  # [-] largest radius of a coil over the size of the scene
_SLENDER = 0.1  # [-] largest radius of a coil over the length of the spring at rest
_WIRE = 0.22  # [-] radius of the wire over that of the coil
_TURNS = 6  # of a coil
_LEAD = 0.12  # [-] straight part at each end over the length
_FINE = 50  # most springs of one object that are drawn with round coils
_BED = 0.05  # [-] depth of the ground below a foundation over the size of the scene
_ACROSS = 8  # most springs of a foundation along the longest side of its faces


def springs_at_rest(scene: Scene) -> tuple[Surface, ...]:
    """Return the surfaces of a scene's springs and foundations in the reference configuration."""
    return tuple(
        _coils(scene, each, each.points if isinstance(each, Spring) else _bed(scene, each)[1])
        for each in _springs(scene)
    )


def springs_of(result: SolveResult) -> list[tuple[Surface, ...]]:
    """Return the surfaces of springs and foundations in every state of a result; an empty list if there are none."""
    scene, found = result.scene, []
    for each in _springs(scene):
        if isinstance(each, Spring):
            ends = np.asarray(detached(result[each].ends))
            ends = ends.reshape(-1, len(each), 2, 3)
        else:
            vertices, (below, _) = _bed(scene, each)[0], np.moveaxis(_bed(scene, each)[1], 1, 0)
            top = np.asarray(detached(result.positions)).reshape(-1, scene._bodies.n_vertices, 3)[:, vertices]
            ends = np.stack([np.broadcast_to(below, top.shape), top], axis=2)
        found.append([_coils(scene, each, frame) for frame in ends])
    return [tuple(frame) for frame in zip(*found, strict=True)]


def creases_of(scene: Scene) -> np.ndarray:
    """Return the ends of the edges of all creases, (k, 2) vertices of the scene."""
    bodies = scene._bodies
    edges = [
        span.mesh.edges[crease.edges] + span.first_vertex
        for body, span in zip(bodies.deformable, bodies.spans, strict=True)
        for crease in getattr(body, "creases", ())
    ]
    return np.concatenate([np.zeros((0, 2), dtype=np.int64), *edges])


def _springs(scene) -> list[Springs]:
    return [each for each in scene.loads if isinstance(each, Springs)]


def _bed(scene, bed: ElasticFoundation) -> tuple[np.ndarray, np.ndarray]:
    """Return some vertices (k,) of the scene on a foundation, and the ends of their springs at rest (k, 2, 3) m.

    The end on the ground is the first.
    """
    span = scene._bodies.of(bed)
    vertices, _, _, normals = bed._lumped(span.mesh)
    vertices, first = np.unique(vertices, return_index=True)
    points, normals = span.mesh.rest_positions[vertices], normals[first]
    side = max(float(np.ptp(points, axis=0).max()) / _ACROSS, 1e-300)
    _, some = np.unique(np.round((points - points.min(axis=0)) / side), axis=0, return_index=True)
    some = np.sort(some)
    down = (
        normals
        if not isinstance(bed.direction, np.ndarray)
        else np.broadcast_to(bed.direction, normals.shape)
    )
    ground = points - _BED * scene._bodies.extent * down
    of_scene = np.arange(scene._bodies.n_vertices)[span.vertices][vertices]
    return of_scene[some], np.stack([ground, points], axis=1)[some]


def _coils(scene, springs: Any, ends: np.ndarray) -> Surface:
    """Return coils between ends (n, 2, 3) m, with a block at each end that is fixed to the ground."""
    radius = _COIL * scene._bodies.extent
    if isinstance(springs, Spring) and springs._is_axial:
        at_rest = np.linalg.norm(np.diff(springs.points, axis=1)[:, 0], axis=1)
        radius = min(radius, _SLENDER * float(at_rest.min()))
    fine = len(ends) <= _FINE
    parts = [_coil(*pair, radius, fine) for pair in ends]
    grounded = 0 if isinstance(springs, ElasticFoundation) else 1 if springs.ground is not None else None
    if grounded is not None:
        parts += [_block(end, radius) for end in ends[:, grounded]]
    return joined(parts)


def _coil(a: np.ndarray, b: np.ndarray, radius: float, fine: bool) -> Surface:
    """Return the wire of a spring from a to b, (3,) m each, as a tube around a helix."""
    steps, sides = (8, 5) if fine else (4, 3)
    share = np.linspace(0.0, 1.0, _TURNS * steps + 1)
    along = b - a
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
    radius = max(min(radius, 0.5 * length), 1e-3 * radius)  # a spring without length is a point
    side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    side /= np.linalg.norm(side)
    angle = 2.0 * np.pi * _TURNS * share
    circle = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(axis, side)
    wound = a + (_LEAD + (1.0 - 2.0 * _LEAD) * share)[:, None] * along + radius * circle
    line = np.concatenate([a[None], a[None] + _LEAD * along, wound, b[None] - _LEAD * along, b[None]])
    return tube(line, _WIRE * radius, sides)


def tube(line: np.ndarray, radius: float, sides: int) -> Surface:
    """Return a tube around a line (n, 3) m."""
    tangents = np.gradient(line, axis=0)
    tangents /= np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), 1e-300)
    helper = np.eye(3)[np.argmin(np.abs(tangents), axis=1)]
    across = np.cross(tangents, helper)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    for k in range(1, len(line)):  # the least rotation from one ring to the next
        across[k] = across[k - 1] - (across[k - 1] @ tangents[k]) * tangents[k]
        across[k] /= max(float(np.linalg.norm(across[k])), 1e-300)
    other = np.cross(tangents, across)
    angles = 2.0 * np.pi * np.arange(sides) / sides
    rings = line[:, None] + radius * (
        np.cos(angles)[None, :, None] * across[:, None] + np.sin(angles)[None, :, None] * other[:, None]
    )
    here, there = np.arange(sides), (np.arange(sides) + 1) % sides
    band = np.concatenate(
        [
            np.stack([here, there, there + sides], axis=1),
            np.stack([here, there + sides, here + sides], axis=1),
        ]
    )
    faces = (sides * np.arange(len(line) - 1)[:, None, None] + band).reshape(-1, 3)
    return rings.reshape(-1, 3), faces


def _block(center: np.ndarray, half: float) -> Surface:
    """Return a cube around a point (3,) m."""
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return center + half * corners, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
