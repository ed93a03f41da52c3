"""Solves the equations of displacement ties, each for one dof, by Gaussian elimination. The core takes the result."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .displacement_ties import Equations

_ROUND_OFF = 1e-12  # [-] Coefficients below this count as zero.
_PARALLEL = 1e-9  # [-] Largest component of a unit vector across an axis to which it counts as parallel.


class TiedDof(NamedTuple):
    """A displacement that is a sum of others and of prescribed ones.

    A dof has the number 3 vertex + axis, for an axis of the vertex's frame. parts: (dof, weight). moves: (number of a
    support's move, axis, weight).
    """

    dof: int
    parts: tuple[tuple[int, float], ...]
    moves: tuple[tuple[int, int, float], ...]


class Frames:
    """The axes of the displacements of each vertex: those of the world, or of its own frame.

    nodes: (k, 5), frames: (k, 3, 3), as in Constraints.
    """

    def __init__(self, nodes: np.ndarray, frames: np.ndarray):
        self._own: dict[int, np.ndarray] = {}
        self.held: dict[int, int] = {}  # by dof: its move, -1 if it is fixed
        for (vertex, count, *moves), frame in zip(nodes, frames, strict=True):
            aligned = count == 3 or bool((np.abs(frame).max(axis=0) == 1.0).all())
            if not aligned:
                self._own[vertex] = frame
            for k in range(count):
                axis = int(np.argmax(np.abs(frame[:, k]))) if aligned and count < 3 else k
                self.held[3 * vertex + axis] = moves[k]

    def along(self, vertex: int, direction: np.ndarray) -> tuple[int, float] | None:
        """Return the dof of a vertex whose axis is parallel to a unit vector, and the sign; None if no axis is parallel."""
        parts = direction @ self._own.get(vertex, np.eye(3))
        axis = int(np.argmax(np.abs(parts)))
        if np.abs(np.delete(parts, axis)).max() > _PARALLEL:
            return None
        return 3 * vertex + axis, float(np.sign(parts[axis]))


def eliminated(
    equations: Iterable[Equations], frames: Frames, number_of_move: Any
) -> tuple[tuple[TiedDof, ...], list[Any]]:
    """Return the dofs that the equations determine from the others, and the ties whose displacements must not change.

    The latter prescribe what supports or other ties prescribe as well. number_of_move: (move or None) -> its number in the
    core. Raises ValueError if equations contradict each other or supports, or if a vertex has no axis along the direction of
    an equation.
    """
    given: dict[int, Any] = {}  # moves by number
    bound: dict[int, Any] = {}  # ties by the number of their move
    solved: dict[int, tuple[dict[int, float], dict[tuple[int, int], float]]] = {}
    followers: dict[int, set[int]] = {}  # by dof: the solved ones that it is part of
    for group in equations:
        moves = _moves_of(group, number_of_move)
        given |= {number: group.move for number, _ in moves}
        for row in group.vertices.tolist():
            # The equation, with the dofs that are solved for already replaced: sum of parts = sum of right.
            parts: dict[int, float] = {}  # weights by dof
            right = dict(moves)  # weights by (move, axis)
            order = []
            for vertex, weight in zip(row, group.weights.tolist(), strict=True):
                dof, sign = _dof(vertex, group, frames)
                order.append(dof)
                if dof in solved:
                    of, by = solved[dof]
                    _add(parts, of, sign * weight)
                    _add(right, by, -sign * weight)
                else:
                    _add(parts, {dof: 1.0}, sign * weight)
            parts = {dof: w for dof, w in parts.items() if abs(w) > _ROUND_OFF}
            right = {move: w for move, w in right.items() if abs(w) > _ROUND_OFF}
            free = [dof for dof in [*order, *parts] if dof in parts and dof not in frames.held]
            if not free:
                _check_consistent(parts, right, group, row, frames, given)
                bound |= {number: given[number].support for number, _ in right}
                continue
            pivot, scale = free[0], 1.0 / parts.pop(free[0])
            own = (
                {dof: -scale * w for dof, w in parts.items()},
                {move: scale * w for move, w in right.items()},
            )
            # Dofs solved for earlier that contain the pivot get its solution in its place.
            for follower in followers.pop(pivot, ()):
                of, by = solved[follower]
                weight = of.pop(pivot)
                _add(of, own[0], weight)
                _add(by, own[1], weight)
                for dof in own[0]:
                    followers.setdefault(dof, set()).add(follower)
            solved[pivot] = own
            for dof in own[0]:
                followers.setdefault(dof, set()).add(pivot)
    tied = tuple(
        TiedDof(
            dof,
            tuple((part, w) for part, w in sorted(of.items()) if abs(w) > _ROUND_OFF),
            tuple((*move, w) for move, w in sorted(by.items()) if abs(w) > _ROUND_OFF),
        )
        for dof, (of, by) in sorted(solved.items())
    )
    return tied, list(bound.values())


def _add(to: dict[Any, float], terms: dict[Any, float], weight: float) -> None:
    """Add weighted terms to a sum, both given as {unknown: coefficient}."""
    for key, value in terms.items():
        to[key] = to.get(key, 0.0) + weight * value


def _moves_of(group: Equations, number_of_move: Any) -> dict[tuple[int, int], float]:
    """Return the right side of the equations of a tie, {(number of its move, axis): weight}; empty without a move."""
    if group.move is None:
        return {}
    number = number_of_move(group.move)
    return {(number, axis): float(w) for axis, w in enumerate(group.direction) if w != 0.0}


def _dof(vertex: int, group: Equations, frames: Frames) -> tuple[int, float]:
    """Return the dof of a vertex along the direction of a tie, and its sign; raise ValueError if there is none."""
    found = frames.along(vertex, group.direction)
    if found is None:
        along = ", ".join(f"{value:g}" for value in group.direction)
        raise ValueError(
            f"{group.support!r} ties vertex {vertex} along ({along}), but another support holds or ties it along a "
            "direction that is neither parallel nor perpendicular to this one"
        )
    return found


def _check_consistent(
    parts: dict[int, float],
    right: dict[tuple[int, int], float],
    group: Equations,
    row: list[int],
    frames: Frames,
    given: dict[int, Any],
) -> None:
    """Raise ValueError for an equation that leaves nothing free, unless all that it ties stays in place."""
    tied = f"{group.support!r} ties vertices {', '.join(map(str, row))}"
    apart = sum(w * given[number].translation[axis] for (number, axis), w in right.items())
    size = sum(np.abs(given[number].translation).max() for number, _ in right)
    if any(frames.held[dof] >= 0 for dof in parts) or (parts and apart != 0.0):
        raise ValueError(
            f"{tied}, but supports hold all of them in this direction and move some: leave vertices out of the tie"
        )
    if abs(apart) > _ROUND_OFF * size:
        raise ValueError(
            f"{tied}, whose displacements other ties prescribe already: at a corner, ties along different "
            "sides must have displacements that add up on both ways around"
        )
