"""What touches in a state of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..surroundings.body_contact import BodyContact


@dataclass(frozen=True)
class Touching:
    """What of a contact of bodies touches in one state.

    pairs: (k, 4), the scene's vertices: of a vertex and a face, or of two edges; of three or two, with -1 behind, those of a
        vertex with an edge or another vertex, which take back what several faces would count twice.
    distances: (k,) m, between the parts of each pair. normal_forces: (k,) N, with which they push each other apart;
        negative where they take something back.
    forces: (n_v, 3) N, on every vertex of the scene, with which they push each other apart; friction is not among them.
    """

    pairs: np.ndarray
    distances: np.ndarray
    normal_forces: np.ndarray
    forces: np.ndarray

    @property
    def normal_force(self) -> float:
        """N, of all pairs together."""
        return float(self.normal_forces.sum())

    @property
    def smallest_distance(self) -> float:
        """m; infinite where nothing touches."""
        return float(self.distances.min(initial=np.inf))

    def __repr__(self) -> str:
        near = f", {self.smallest_distance:.4g} m apart at least" if len(self.pairs) else ""
        return f"Touching: {len(self.pairs)} pairs{near}, {self.normal_force:.4g} N"


def touching_in(scene, values, contact: BodyContact, state: np.ndarray) -> Touching:
    """values: of the solve that found the state. Raises ValueError where the contact is none of the scene's bodies."""
    numbers = [k for k, each in enumerate(scene._body_contacts) if each is contact]
    if not numbers:
        raise ValueError(f"contact must be one of bodies, of scene.contacts, got {contact!r:.80}")
    with values.in_core():
        of, pairs, distances, normal_forces, on_nodes = _core.touching_pairs(scene._model, state)
    mine = of == numbers[0]
    forces = np.zeros((scene.mesh.n_vertices, 3))
    there = pairs[mine] >= 0
    np.add.at(forces, pairs[mine][there], on_nodes[mine][there])
    return Touching(pairs[mine], distances[mine], normal_forces[mine], forces)
