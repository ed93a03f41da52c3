"""Nodal and contact forces on the vertices of a result, and the contact pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...model.loads.loads import DeadLoad
from ...model.scene.contact_state import compute_contact_state
from ...model.supports.displacement_ties import DisplacementTie
from ...solve.dynamics.trajectory import Trajectory
from ...solve.statics.equilibrium import Equilibrium

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult


class ContactLoads(NamedTuple):
    """The forces of all contacts of a scene on its vertices.

    forces: (n_v, 3) N, the sums of normal and friction forces. normal_force_magnitudes: (n_v,) N, the sums of the magnitudes
        of normal forces, which do not cancel between the two sides of a shell.
    """

    forces: np.ndarray
    normal_force_magnitudes: np.ndarray

    def pressures(self, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Compute the contact pressure at the vertices, (n_v,) Pa.

        It is the normal force over a third of the area of the vertex's faces in the deformed configuration. Interpolated
        linearly on faces, its integral over the surface of a body is the sum of the normal forces on it. For a shell, both
        sides are added.
        """
        x0, x1, x2 = np.moveaxis(positions[faces], 1, 0)
        thirds = np.linalg.norm(np.cross(x1 - x0, x2 - x0), axis=1) / 6.0
        areas = np.bincount(faces.ravel(), np.repeat(thirds, 3), minlength=len(positions))
        return np.divide(self.normal_force_magnitudes, areas, out=np.zeros(len(positions)), where=areas > 0.0)

    def of(self, vertices: np.ndarray) -> ContactLoads:
        """Return the forces on some of the vertices only."""
        return ContactLoads(self.forces[vertices], self.normal_force_magnitudes[vertices])


def contact_loads(result: SolveResult, index: int) -> ContactLoads:
    """Compute the contact forces in state number `index` of a result."""
    scene, moving = result.scene, isinstance(result, Trajectory)
    values, state = result._values_at(index), result._state_at(index)
    found = [
        result._contact_state(contact, index)
        if moving
        else compute_contact_state(scene, values, contact, state)
        for contact in scene.contacts
    ]
    forces, magnitudes = np.zeros((scene.mesh.n_vertices, 3)), np.zeros(scene.mesh.n_vertices)
    for each in found:
        forces += each._pushes + each.friction
        magnitudes += each.normal_force_magnitudes
    return ContactLoads(forces, magnitudes)


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
            held = result._reaction(support, index)
            np.add.at(forces, held.vertices, held.forces)
        found["reaction"] = forces
    if any(isinstance(load, DeadLoad) for load in scene.loads):
        numbers = result._values_at(index).numbers  # with the `vertex_loads` of the solve, if there are any
        forces = scene._value_layout.of(numbers, "loads", "forces")[: scene.mesh.n_vertices]
        found["load"] = np.ravel(result._load_factors)[index] * forces
    return found
