"""The forces of supports and loads on the vertices of a result, for files."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...model.loads.loads import DeadLoad
from ...model.supports.displacement_ties import DisplacementTie
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.equilibrium import Equilibrium


def nodal_forces(result: Any, index: int) -> dict[str, np.ndarray]:
    """Return the `reaction` of all supports and the dead `load` on the vertices in state `index`, (n_v, 3) N each.

    Only those are there that the scene has; those of EqualDisplacement and Periodic act between vertices and are left out.
    Paths store no reactions: their points would have to be solved again.
    """
    scene, found = result.scene, {}
    supports = [each for each in scene.supports if not isinstance(each, DisplacementTie)]
    if supports and isinstance(result, Equilibrium | Trajectory):
        forces = np.zeros((scene.mesh.n_vertices, 3))
        for support in supports:
            held = (
                result.reaction(support, index)
                if isinstance(result, Trajectory)
                else result.reaction(support)
            )
            np.add.at(forces, held.vertices, held.forces)
        found["reaction"] = forces
    if any(isinstance(load, DeadLoad) for load in scene.loads):
        numbers = result._values_at(index).numbers  # with the `vertex_loads` of the solve, if there are any
        forces = scene._value_layout.of(numbers, "loads", "forces")[: scene.mesh.n_vertices]
        found["load"] = np.ravel(result._load_factors)[index] * forces
    return found
