"""Computes the forces with which supports hold a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.frozen import immutable
from ..supports.constraints import held_directions
from ..supports.displacement_ties import DisplacementTie

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..supports.supports import Support
    from .scene import Scene


@immutable
@dataclass(frozen=True)
class Reaction:
    """The forces and the torque of one support on the bodies in one state. They are NaN in a state that no time step
    led to.

    vertices: (k,), the scene's vertices that it holds, or the images of a Periodic with a displacement.
    forces: (k, 3) N, on them. force: (3,) N, their sum.
    positions: (k, 3) m, of these vertices.

    If several supports hold a vertex along one direction, the force along it is counted for the first of them in
    scene.supports: only the sum over all supports is the force that holds the scene.
    """

    vertices: np.ndarray
    forces: np.ndarray
    positions: np.ndarray
    _couple: np.ndarray  # (3,) N m, the moment on the edge directions that it holds

    @property
    def force(self) -> np.ndarray:
        """The resultant force on all vertices, (3,) N."""
        return self.forces.sum(axis=0)

    def torque(self, point: Numbers = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the torque about a point (3,) m, (3,) N m.

        It includes the moment with which a Clamp or a SymmetryPlane holds the sheet's direction across edges.
        """
        about = quantity("point", "m", point, (3,))
        return np.cross(self.positions - about, self.forces).sum(axis=0) + self._couple

    def __repr__(self) -> str:
        numbers = ", ".join(f"{each:.4g}" for each in self.force)
        return f"Reaction: ({numbers}) N on {len(self.vertices)} vertices"


def reaction_in(scene: Scene, support: Support, state: np.ndarray, held: np.ndarray) -> Reaction:
    """Return the reaction of one support in a state.

    held: (m, 3) N, the forces on the nodes that the constraints hold, then on the tied degrees of freedom. Raises
    ValueError if the scene has no such support, or if it is a tie without a displacement.
    """
    support = scene._own(support)
    if not any(each is support for each in scene.supports):
        raise ValueError(
            f"support must be one of scene.supports itself, not another one with equal values, got {support!r:.80}"
        )
    if isinstance(support, DisplacementTie):
        return _reaction_of_tie(scene, support, state, held)
    constraints = scene._constraints
    rows = {node: k for k, node in enumerate(constraints.held_nodes[:, 0].tolist())}
    mine = [(v, along) for s, v, along in held_directions(scene._bodies, scene.supports) if s is support]
    vertices = np.array([vertex for vertex, _ in mine], dtype=np.int64)
    forces = np.array([along.T @ (along @ held[rows[vertex]]) for vertex, along in mine]).reshape(-1, 3)
    couple = np.zeros(3)
    before = 3 * scene._bodies.n_points
    for k, owner in enumerate(constraints.direction_owners):
        if owner is support:
            direction = state[before + 3 * k : before + 3 * k + 3]
            couple = couple + np.cross(direction, held[rows[scene.mesh.n_vertices + k]])
    return Reaction(vertices, forces, scene._model.positions(state)[vertices], couple)


def _reaction_of_tie(scene: Scene, tie: DisplacementTie, state: np.ndarray, held: np.ndarray) -> Reaction:
    """Return the forces that a prescribed displacement between vertices and their images exerts on the images."""
    if getattr(tie, "displacement", None) is None:
        raise ValueError(
            f"{tie!r} has no reaction: its forces on the vertices cancel, as it prescribes nothing"
        )
    constraints, forces = scene._constraints, {}
    own = {k for k, move in enumerate(constraints.moves) if move.support is tie}
    rows = held[len(constraints.held_nodes) :]
    for tied, force in zip(constraints.tied, rows, strict=True):
        for move, axis, weight in tied.moves:
            if move in own:
                forces.setdefault(tied.dof // 3, np.zeros(3))[axis] += weight * force[axis]
    vertices = np.array(sorted(forces), dtype=np.int64)
    rows = np.array([forces[vertex] for vertex in vertices]).reshape(-1, 3)
    return Reaction(vertices, rows, scene._model.positions(state)[vertices], np.zeros(3))
