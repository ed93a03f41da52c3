"""Combines the supports of a scene: the directions in which nodes are held, and rigid motions that remain free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..bodies.bodies import Bodies
from ..bodies.body_ranges import Span
from ..bodies.ties import joined_components
from .displacement_ties import DisplacementTie, Equations
from .elimination import Frames, TiedDof, eliminated
from .supports import DirectedEdges, Held, RigidMove

if TYPE_CHECKING:
    from ..rigid.joints import Joint
    from .supports import Support


class VertexConstraint(NamedTuple):
    """The constraint of one support on a vertex: the held directions (m, 3), and the move, or None if it is fixed."""

    along: np.ndarray
    move: RigidMove | None


# Fractions of two moves at which they are compared: a rotation by a full turn ends where it began at 1, but not at 0.37.
_COMPARED_AT = (0.37, 1.0)


@dataclass(frozen=True)
class Constraints:
    """The constraints of all supports, as the core takes them. Nodes are vertices, followed by directions."""

    directed_edges: np.ndarray  # (k, 2): the scene's edge, direction
    directions: np.ndarray  # (n_d, 3)
    held_nodes: np.ndarray  # (m, 5): node, number of held directions, number of the move of each or -1
    held_frames: np.ndarray  # (m, 3, 3): columns; the held directions first, then those along which ties act
    equations: tuple[Equations, ...]  # those of all ties of displacements, with the scene's vertices
    tied: tuple[TiedDof, ...]  # the dofs that these equations eliminate
    bound: list[
        Any
    ]  # ties that prescribe what supports prescribe too, so that their displacements must not change in time
    moves: tuple[RigidMove, ...]
    direction_owners: tuple[Any, ...]  # (n_d,), the support that holds each direction, or None


def gather(
    bodies: Bodies, supports: Sequence[Support], free_directions: np.ndarray, sharing: bool = True
) -> Constraints:
    """Combine all supports of a scene.

    free_directions: (k, 3), appended to the fixed directions; they do not move. sharing: let edges with equal directions
    across them share one.
    """
    moves: list[RigidMove] = []
    mesh, pairs_of = bodies.mesh, [(s, bodies.of(s)) for s in supports]
    held = [h for s, span in pairs_of for h in held_by(s, span, bodies)]
    equations = [e for s, span in pairs_of for e in _equations(s, span, bodies)]
    numbers: dict[int, int] = {}
    nodes, frames = _held_vertices(bodies, held, moves, numbers, _tied_along(equations))
    tied, bound = eliminated(equations, Frames(nodes, frames), lambda move: _number(move, moves, numbers))
    pairs, directions, direction_moves, owners = _directed_edges(
        [(s, d) for s, span in pairs_of for d in _directed(s, span)], moves, sharing
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
        tuple(equations),
        tied,
        bound,
        tuple(moves),
        (*owners, *[None] * len(free_directions)),
    )


def check_shared(bodies: Bodies, supports: Sequence[Support], vertices: np.ndarray) -> None:
    """Raise ValueError if supports disagree on the position of one of these vertices of the scene."""
    found = []
    for held in (h for s in supports for h in held_by(s, bodies.of(s), bodies)):
        some = np.isin(held.vertices, vertices)
        found.append(held._replace(vertices=held.vertices[some], directions=held.directions[some]))
    _held_vertices(bodies, found, [], {}, {})


def held_by(support: Support, span: Span, bodies: Bodies) -> list[Held]:
    """Return the vertices that a support holds, with the scene's numbers."""
    return [
        held._replace(vertices=bodies.original[held.vertices + span.first_vertex])
        for held in support._held(span.mesh)
    ]


def held_directions(bodies: Bodies, supports: Sequence[Support]) -> list[tuple[object, int, np.ndarray]]:
    """Return (support, vertex of the scene, held directions (m, 3), orthonormal) for all supports and vertices.

    Directions of a vertex that an earlier support holds are left out of those of later ones.
    """
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
    """Return the edges whose direction a support holds, with the scene's numbers."""
    return [each._replace(edges=each.edges + span.first_edge) for each in support._directed(span.mesh)]


def free_rigid_motions(
    bodies: Bodies, constraints: Constraints, on_joints: Sequence[Joint] = ()
) -> list[str]:
    """Return a description of each rigid motion of a connected component that no support prevents.

    on_joints: vertices fixed to links of skeletons; their components are left out, because joints may hold them.
    """
    found, mesh, size = [], bodies.mesh, bodies.extent
    components = bodies.components
    for parts in _tied_parts(components, constraints.equations):
        members = [np.flatnonzero(components == part) for part in parts]
        if np.isin(on_joints, np.concatenate(members)).any():
            continue
        centers = [mesh.rest_positions[vertices].mean(axis=0) for vertices in members]
        rows = [np.zeros((6, 6 * len(parts)))]
        for k, (part, center) in enumerate(zip(parts, centers, strict=True)):
            own = _prevented(bodies, constraints, components == part, center)
            rows.append(np.pad(own, ((0, 0), (6 * k, 6 * (len(parts) - k - 1)))))
        rows += _prevented_by_ties(bodies, constraints.equations, parts, centers)
        _, values, modes = np.linalg.svd(np.concatenate(rows), full_matrices=False)
        for mode in modes[values < 1e-8 * max(values[0], 1e-300)].reshape(-1, len(parts), 6):
            k = int(np.argmax(np.linalg.norm(mode, axis=1)))
            where = f" of part {parts[k]} (with vertex {members[k][0]})" if components.max() > 0 else ""
            found.append(_in_words(mode[k] / np.linalg.norm(mode[k]), centers[k], size) + where)
    return found


def _tied_parts(components: np.ndarray, equations: Sequence[Equations]) -> list[list[int]]:
    """Return the connected components in groups that equations tie to each other."""
    pairs = [np.stack([e.vertices[:, :-1].ravel(), e.vertices[:, 1:].ravel()], axis=1) for e in equations]
    group = joined_components(components, np.concatenate(pairs)) if pairs else components
    _, first = np.unique(components, return_index=True)
    of_part = group[first]
    return [np.flatnonzero(of_part == k).tolist() for k in range(of_part.max(initial=-1) + 1)]


def _prevented_by_ties(
    bodies: Bodies, equations: Sequence[Equations], parts: list[int], centers: list[np.ndarray]
) -> list[np.ndarray]:
    """Return the combinations of rigid motions of these parts that equations prevent, rows (k, 6 len(parts))."""
    found, mesh, size = [], bodies.mesh, bodies.extent
    place = np.full(bodies.components.max(initial=-1) + 1, -1)
    place[parts] = np.arange(len(parts))
    for each in equations:
        of = place[bodies.components[each.vertices]]
        arms = (mesh.rest_positions[each.vertices] - np.array(centers)[of]) / size
        along = np.broadcast_to(each.direction, arms.shape)
        motions = each.weights[:, None] * np.concatenate([along, np.cross(arms, along)], axis=2)
        rows = np.zeros((len(of), len(parts), 6))
        for k in range(of.shape[1]):
            rows[np.arange(len(of)), of[:, k]] += motions[:, k]
        here = of[:, 0] >= 0
        found.append(rows[here].reshape(-1, 6 * len(parts)))
    return found


def _equations(support: Support, span: Span, bodies: Bodies) -> list[Equations]:
    """Return the equations of a tie of displacements, with the scene's vertices."""
    if not isinstance(support, DisplacementTie):
        return []
    return [
        each._replace(vertices=bodies.original[each.vertices + span.first_vertex])
        for each in support._equations(span.mesh)
    ]


def _tied_along(equations: list[Equations]) -> dict[int, list[np.ndarray]]:
    """Return the directions of ties that are no world axes, for each tied vertex."""
    found: dict[int, list[np.ndarray]] = {}
    for each in equations:
        slanted = [each.direction] * int(np.abs(each.direction).max() != 1.0)
        for vertex in np.unique(each.vertices).tolist():
            found.setdefault(vertex, []).extend(slanted)
    return found


def _held_vertices(
    bodies: Bodies,
    held: list[Held],
    moves: list[RigidMove],
    numbers: dict[int, int],
    tied: dict[int, list[np.ndarray]],
):
    """Return the rows of held_nodes and held_frames of all vertices that supports hold or tie.

    numbers: the number of each move, by its id. tied: for each tied vertex, the directions of its ties that are no world
        axes.
    """
    constraints: dict[int, list[VertexConstraint]] = {vertex: [] for vertex in tied}
    for support in held:
        for vertex, along in zip(support.vertices.tolist(), support.directions, strict=True):
            constraints.setdefault(vertex, []).append(VertexConstraint(along, support.move))
    nodes, frames = [], []
    for vertex, some in sorted(constraints.items()):
        _check_agree(bodies, vertex, some)
        frame, count, by = _frame(some) if some else (np.eye(3), 0, [None] * 3)
        if count < 3 and tied.get(vertex):
            frame = _completed_frame(frame[:, :count], tied[vertex])
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


def _check_agree(bodies, vertex: int, constraints: list[VertexConstraint]) -> None:
    """Raise ValueError if supports that share a vertex disagree on its position.

    Two moving supports may hold a vertex along directions at right angles; along others, they must move it to the same
    position. A fixed support and a moving one may share a vertex if the move has no component along the fixed directions.
    """
    point = bodies.mesh.rest_positions[[vertex]]

    def positions(move: RigidMove | None) -> np.ndarray:
        return np.concatenate([point if move is None else move.moved(point, at) for at in _COMPARED_AT])

    for k, a in enumerate(constraints):
        for b in constraints[:k]:
            if a.move is b.move:
                continue
            apart = positions(a.move) - positions(b.move)
            if a.move is None or b.move is None:
                still = a if a.move is None else b
                if np.abs(apart @ still.along.T).max() > 1e-9 * bodies.extent:
                    raise ValueError(
                        f"one support holds vertex {vertex} along a direction in which another moves it"
                    )
                continue
            shared = np.abs(a.along @ b.along.T) > 1e-9
            if not shared.any():
                continue
            both = np.concatenate([a.along[shared.any(axis=1)], b.along[shared.any(axis=0)]])
            turned = not np.allclose(a.move.rotation, b.move.rotation)
            if turned or np.abs(apart @ both.T).max() > 1e-12 * bodies.extent:
                raise ValueError(f"two supports move vertex {vertex} to different places")


def _frame(constraints: list[VertexConstraint]) -> tuple[np.ndarray, int, list[RigidMove | None]]:
    """Return an orthonormal frame (columns) of a vertex, the number of its held directions, and their moves.

    The held directions come first. Where a fixed support and a moving one hold the same direction, the move counts.
    Held world axes stay world axes.
    """
    directions = np.concatenate([each.along for each in constraints])
    moving = [each for each in constraints if each.move is not None]
    moves = list({id(each.move): each.move for each in moving}.values())
    axes = np.unique(np.argmax(np.abs(directions), axis=1))
    if np.all(np.abs(directions).max(axis=1) == 1.0):
        frame = np.eye(3)[:, [*axes, *np.setdiff1d(np.arange(3), axes)]]
        return (
            frame,
            len(axes),
            [_move_along(frame[:, k], moving) if k < len(axes) else None for k in range(3)],
        )
    if len(moves) <= 1:
        _, values, rows = np.linalg.svd(directions)
        count = int(np.sum(values > 1e-9))
        return (np.eye(3) if count == 3 else rows.T), count, [*moves, None][:1] * 3
    columns, by = np.zeros((3, 0)), []
    for each in [*moving, *(fixed for fixed in constraints if fixed.move is None)]:
        for along in each.along:
            remaining = along - columns @ (columns.T @ along)
            if np.linalg.norm(remaining) > 1e-9:
                columns = np.column_stack([columns, remaining / np.linalg.norm(remaining)])
                by.append(each.move)
    free = np.linalg.svd(columns.T)[2][len(by) :].T
    return np.column_stack([columns, free]), len(by), [*by, None, None, None][:3]


def _completed_frame(held: np.ndarray, directions: list[np.ndarray]) -> np.ndarray:
    """Return an orthonormal frame (columns): held directions (3, m), then the parts of `directions` perpendicular to
    them.
    """
    columns = held
    for along in directions:
        remaining = along - columns @ (columns.T @ along)
        if np.linalg.norm(remaining) > 1e-9:
            columns = np.column_stack([columns, remaining / np.linalg.norm(remaining)])
    if columns.shape[1] == 3:
        return columns
    return np.column_stack([columns, np.linalg.svd(columns.T)[2][columns.shape[1] :].T])


def _move_along(axis: np.ndarray, moving: list[VertexConstraint]) -> RigidMove | None:
    return next((each.move for each in moving if (np.abs(each.along @ axis) == 1.0).any()), None)


def _directed_edges(directed: list[tuple[object, DirectedEdges]], moves: list[RigidMove], sharing: bool):
    pairs, directions, direction_moves, owners = [], [], [], []
    seen: set[int] = set()
    for support, group in directed:
        move = -1
        if group.move is not None:
            move = len(moves)
            moves.append(group.move)
        # Edges that share a direction share a node.
        keys = np.round(group.directions, 12) + 0.0 if sharing else np.arange(len(group.edges))[:, None]
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
    """Return the infinitesimal rigid motions that supports prevent, rows (k, 6): translation, size-scaled rotation."""
    rows, mesh, size = [np.zeros((1, 6))], bodies.mesh, bodies.extent
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
    shown = mode[3:] if np.linalg.norm(mode[3:]) >= 1e-6 else mode[:3]
    first = int(np.argmax(np.abs(shown) > 0.5 * np.abs(shown).max()))
    mode = mode * np.sign(
        shown[first]
    )  # the sign of a mode is arbitrary; here it does not depend on rounding
    translation, rotation = mode[:3], mode[3:]
    if np.linalg.norm(rotation) < 1e-6:
        return f"translation along {_vector(translation)}"
    axis = rotation / np.linalg.norm(rotation)
    point = center + np.cross(axis, translation) * size / np.linalg.norm(rotation)
    return f"rotation about {_vector(axis)} through {_vector(point)} m"


def _vector(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{0.0 if abs(v) < 1e-9 else v:.3g}" for v in values) + ")"
