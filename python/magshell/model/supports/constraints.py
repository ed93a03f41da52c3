"""Supports put together: which nodes are held along which directions, and whether anything can still move freely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..bodies.bodies import Bodies
from ..bodies.body_ranges import Span
from .supports import DirectedEdges, Held, RigidMove

if TYPE_CHECKING:
    from ..rigid.joints import Joint
    from .supports import Support


class Hold(NamedTuple):
    """What one support does to a vertex: directions (m, 3), and its move, or None where it stays."""

    along: np.ndarray
    move: RigidMove | None


_LOOKED_AT = (0.37, 1.0)  # a full turn ends where it began, but is elsewhere on its way


@dataclass(frozen=True)
class Constraints:
    """What the core takes. Nodes are vertices, followed by directions."""

    directed_edges: np.ndarray  # (k, 2): the scene's edge, direction
    directions: np.ndarray  # (n_d, 3)
    held_nodes: np.ndarray  # (m, 5): node, how many directions, of each the move or -1
    held_frames: np.ndarray  # (m, 3, 3): columns, the held directions first
    moves: tuple[RigidMove, ...]
    direction_owners: tuple[Any, ...]  # (n_d,), the support that holds each direction, or None


def gather(bodies: Bodies, supports: Sequence[Support], free_directions: np.ndarray) -> Constraints:
    """All supports of a scene as one. `free_directions` (k, 3) are appended to the directions, held and still."""
    moves: list[RigidMove] = []
    mesh, places = bodies.mesh, [(s, bodies.of(s)) for s in supports]
    nodes, frames = _held_vertices(bodies, [h for s, span in places for h in held_by(s, span, bodies)], moves)
    pairs, directions, direction_moves, owners = _directed_edges(
        [(s, d) for s, span in places for d in _directed(s, span)], moves
    )
    directions = np.concatenate([directions, free_directions])
    direction_moves += [-1] * len(free_directions)
    for k, move in enumerate(direction_moves):
        nodes.append((mesh.n_vertices + k, 3, move, move, move))
        frames.append(np.eye(3))
    return Constraints(
        np.array(pairs, dtype=np.int32).reshape(-1, 2),
        directions,
        np.array(nodes, dtype=np.int32).reshape(-1, 5),
        np.array(frames).reshape(-1, 3, 3),
        tuple(moves),
        (*owners, *[None] * len(free_directions)),
    )


def check_shared(bodies: Bodies, supports: Sequence[Support], vertices: np.ndarray) -> None:
    """Raises ValueError where supports disagree on where one of these vertices of the scene is."""
    found = []
    for held in (h for s in supports for h in held_by(s, bodies.of(s), bodies)):
        some = np.isin(held.vertices, vertices)
        found.append(held._replace(vertices=held.vertices[some], directions=held.directions[some]))
    _held_vertices(bodies, found, [])


def held_by(support: Support, span: Span, bodies: Bodies) -> list[Held]:
    """With the scene's vertices."""
    return [
        held._replace(vertices=bodies.original[held.vertices + span.first_vertex])
        for held in support._held(span.mesh)
    ]


def held_directions(bodies: Bodies, supports: Sequence[Support]) -> list[tuple[object, int, np.ndarray]]:
    """(support, vertex of the scene, (m, 3) orthonormal) of all that they hold; what an earlier support holds of a vertex is
    left out of the later ones'."""
    found = []
    taken: dict[int, np.ndarray] = {}
    for support in supports:
        for held in held_by(support, bodies.of(support), bodies):
            for vertex, along in zip(held.vertices.tolist(), held.directions, strict=True):
                before = taken.get(vertex, np.zeros((0, 3)))
                rest = along - along @ before.T @ before
                _, values, rows = np.linalg.svd(rest)
                own = rows[: int(np.sum(values > 1e-9))]
                taken[vertex] = np.concatenate([before, own])
                found.append((support, vertex, own))
    return found


def _directed(support, span: Span) -> list[DirectedEdges]:
    """With the scene's edges."""
    return [each._replace(edges=each.edges + span.first_edge) for each in support._directed(span.mesh)]


def free_rigid_motions(
    bodies: Bodies, constraints: Constraints, on_joints: Sequence[Joint] = ()
) -> list[str]:
    """The rigid motions that no support prevents, in words; of every connected part.

    on_joints: vertices that a skeleton holds, as far as its joints do: their parts are not asked.
    """
    found, mesh, size, components = [], bodies.mesh, bodies.size, bodies.components
    for part in range(components.max(initial=-1) + 1):
        vertices = np.flatnonzero(components == part)
        if np.isin(on_joints, vertices).any():
            continue
        center = mesh.rest_positions[vertices].mean(axis=0)
        rows = _prevented(bodies, constraints, components == part, center)
        _, values, modes = np.linalg.svd(np.concatenate([rows, np.zeros((6, 6))]), full_matrices=False)
        for mode in modes[values < 1e-8 * max(values[0], 1e-300)]:
            where = f" of part {part} (with vertex {vertices[0]})" if components.max() > 0 else ""
            found.append(_in_words(mode, center, size) + where)
    return found


def _held_vertices(bodies: Bodies, held: list[Held], moves: list[RigidMove]):
    holds: dict[int, list[Hold]] = {}
    for support in held:
        for vertex, along in zip(support.vertices.tolist(), support.directions, strict=True):
            holds.setdefault(vertex, []).append(Hold(along, support.move))
    numbers: dict[int, int] = {}
    nodes, frames = [], []
    for vertex, some in sorted(holds.items()):
        _check_agree(bodies, vertex, some)
        frame, count, by = _frame(some)
        nodes.append((vertex, count, *(_number(move, moves, numbers) for move in by)))
        frames.append(frame)
    return nodes, frames


def _number(move: RigidMove | None, moves: list[RigidMove], numbers: dict[int, int]) -> int:
    if move is None:
        return -1
    if id(move) not in numbers:
        numbers[id(move)] = len(moves)
        moves.append(move)
    return numbers[id(move)]


def _check_agree(bodies, vertex: int, holds: list[Hold]) -> None:
    """Supports may share a vertex where they hold it along directions at right angles, or have it at the same place along
    those that are not. One that stays may hold it beside one that moves, as long as that does not move it along what it
    holds."""
    point = bodies.mesh.rest_positions[[vertex]]

    def places(move: RigidMove | None) -> np.ndarray:
        return np.concatenate([point if move is None else move.moved(point, at) for at in _LOOKED_AT])

    for k, a in enumerate(holds):
        for b in holds[:k]:
            if a.move is b.move:
                continue
            apart = places(a.move) - places(b.move)
            if a.move is None or b.move is None:
                still = a if a.move is None else b
                if np.abs(apart @ still.along.T).max() > 1e-9 * bodies.size:
                    raise ValueError(
                        f"one support holds vertex {vertex} along a direction in which another moves it"
                    )
                continue
            shared = np.abs(a.along @ b.along.T) > 1e-9
            if not shared.any():
                continue
            both = np.concatenate([a.along[shared.any(axis=1)], b.along[shared.any(axis=0)]])
            turned = not np.allclose(a.move.rotation, b.move.rotation)
            if turned or np.abs(apart @ both.T).max() > 1e-12 * bodies.size:
                raise ValueError(f"two supports move vertex {vertex} to different places")


def _frame(holds: list[Hold]) -> tuple[np.ndarray, int, list[RigidMove | None]]:
    """Orthonormal columns, the held ones first, their number, and whose each is; of what moves and what stays along the
    same direction, that of what moves. World axes where the directions are world axes."""
    directions = np.concatenate([hold.along for hold in holds])
    moving = [hold for hold in holds if hold.move is not None]
    movers = list({id(hold.move): hold.move for hold in moving}.values())
    axes = np.unique(np.argmax(np.abs(directions), axis=1))
    if np.all(np.abs(directions).max(axis=1) == 1.0):
        frame = np.eye(3)[:, [*axes, *np.setdiff1d(np.arange(3), axes)]]
        return frame, len(axes), [_mover(frame[:, k], moving) if k < len(axes) else None for k in range(3)]
    if len(movers) <= 1:
        _, values, rows = np.linalg.svd(directions)
        count = int(np.sum(values > 1e-9))
        return (np.eye(3) if count == 3 else rows.T), count, [*movers, None][:1] * 3
    columns, by = np.zeros((3, 0)), []
    for hold in [*moving, *(hold for hold in holds if hold.move is None)]:
        for along in hold.along:
            rest = along - columns @ (columns.T @ along)
            if np.linalg.norm(rest) > 1e-9:
                columns = np.column_stack([columns, rest / np.linalg.norm(rest)])
                by.append(hold.move)
    free = np.linalg.svd(columns.T)[2][len(by) :].T
    return np.column_stack([columns, free]), len(by), [*by, None, None, None][:3]


def _mover(axis: np.ndarray, moving: list[Hold]) -> RigidMove | None:
    return next((hold.move for hold in moving if (np.abs(hold.along @ axis) == 1.0).any()), None)


def _directed_edges(directed: list[tuple[object, DirectedEdges]], moves: list[RigidMove]):
    pairs, directions, direction_moves, owners = [], [], [], []
    seen: set[int] = set()
    for support, group in directed:
        move = -1
        if group.move is not None:
            move = len(moves)
            moves.append(group.move)
        # Edges that share a direction share a node.
        keys = np.round(group.directions, 12) + 0.0
        _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        for edge, which in zip(group.edges.tolist(), inverse.ravel().tolist(), strict=True):
            if edge in seen:
                raise ValueError(f"two supports hold the direction across edge {edge}")
            seen.add(edge)
            pairs.append((edge, len(directions) + which))
        directions.extend(group.directions[first])
        direction_moves.extend([move] * len(first))
        owners.extend([support] * len(first))
    return pairs, np.array(directions).reshape(-1, 3), direction_moves, owners


def _prevented(bodies, constraints: Constraints, in_part: np.ndarray, center: np.ndarray) -> np.ndarray:
    """Rows (k, 6) of the infinitesimal rigid motions (translation, size-scaled rotation) that supports see."""
    rows, mesh, size = [np.zeros((1, 6))], bodies.mesh, bodies.size
    for (node, count, *_), frame in zip(constraints.held_nodes, constraints.held_frames, strict=True):
        if node < mesh.n_vertices and in_part[node]:
            along = frame[:, :count].T
            arm = (mesh.rest_positions[node] - center) / size
            rows.append(np.concatenate([along, np.cross(arm, along)], axis=1))
    if len(constraints.directed_edges):
        ends = mesh.edges[constraints.directed_edges[:, 0]]
        ends = ends[in_part[ends[:, 0]]]
        along = mesh.rest_positions[ends[:, 1]] - mesh.rest_positions[ends[:, 0]]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        rows.append(np.concatenate([np.zeros_like(along), along], axis=1))
    return np.concatenate(rows)


def _in_words(mode: np.ndarray, center: np.ndarray, size: float) -> str:
    translation, rotation = mode[:3], mode[3:]
    if np.linalg.norm(rotation) < 1e-6:
        return f"translation along {_vector(translation)}"
    axis = rotation / np.linalg.norm(rotation)
    point = center + np.cross(axis, translation) * size / np.linalg.norm(rotation)
    return f"rotation about {_vector(axis)} through {_vector(point)} m"


def _vector(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{0.0 if abs(v) < 1e-9 else v:.3g}" for v in values) + ")"
