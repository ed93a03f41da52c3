"""With what forces supports hold a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.frozen import immutable
from ..supports.constraints import held_directions

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ..supports.supports import Support
    from .scene import Scene


@immutable
@dataclass(frozen=True)
class Reaction:
    """What one support does to the bodies in one state. NaN in a state that no time step led to.

    vertices: (k,), the scene's, that it holds. forces: (k, 3) N, on them. force: (3,) N, their sum.
    positions: (k, 3) m, where they are.

    Where several supports hold a vertex along one direction, the force along it is that of the first in scene.supports:
    the sum over all supports is what holds the scene.
    """

    vertices: np.ndarray
    forces: np.ndarray
    positions: np.ndarray
    _couple: np.ndarray  # (3,) N m, of the directions that it holds

    @property
    def force(self) -> np.ndarray:
        """(3,) N, of all points together."""
        return self.forces.sum(axis=0)

    def torque(self, point: Numbers = (0.0, 0.0, 0.0)) -> np.ndarray:
        """(3,) N m about a point (3,) m: of the forces, and of the couple with which a Clamp or a SymmetryPlane holds the
        sheet's direction across edges."""
        about = quantity("point", "m", point, (3,))
        return np.cross(self.positions - about, self.forces).sum(axis=0) + self._couple

    def __repr__(self) -> str:
        numbers = ", ".join(f"{each:.4g}" for each in self.force)
        return f"Reaction: ({numbers}) N on {len(self.vertices)} vertices"


def reaction_in(scene: Scene, support: Support, state: np.ndarray, held: np.ndarray) -> Reaction:
    """held: (m, 3) N, of the constraints' held nodes. Raises ValueError where the support is none of the scene's."""
    if not any(each is support for each in scene.supports):
        raise ValueError(f"support must be one of scene.supports, got {support!r:.80}")
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
