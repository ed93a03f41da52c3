"""With what forces the contacts of a result load its vertices, and the pressure that they make."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...model.scene.contact_state import compute_contact_state
from ...solve.dynamics.trajectory import Trajectory

if TYPE_CHECKING:
    from ..._input.kinds import SolveResult


class ContactLoads(NamedTuple):
    """Of all contacts together: forces (n_v, 3) N on every vertex, normal ones and friction; pushed (n_v,) N, what vertices
    have of the normal forces without regard to their direction."""

    forces: np.ndarray
    normal_force_magnitudes: np.ndarray

    def pressures(self, positions: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """(n_v,) Pa, of vertices that have a third of each of their faces as these are now. Over the surface of a body its
        integral, linear on faces, is the sum of the normal forces on it; a sheet has both of its sides' in one."""
        x0, x1, x2 = np.moveaxis(positions[faces], 1, 0)
        thirds = np.linalg.norm(np.cross(x1 - x0, x2 - x0), axis=1) / 6.0
        areas = np.bincount(faces.ravel(), np.repeat(thirds, 3), minlength=len(positions))
        return np.divide(self.normal_force_magnitudes, areas, out=np.zeros(len(positions)), where=areas > 0.0)

    def of(self, vertices: np.ndarray) -> ContactLoads:
        """Of some vertices alone."""
        return ContactLoads(self.forces[vertices], self.normal_force_magnitudes[vertices])


def contact_loads(result: SolveResult, index: int) -> ContactLoads:
    """In one of its states."""
    scene, moving = result.scene, isinstance(result, Trajectory)
    values, state = result._values_at(index), result._state_at(index)
    found = [
        result.contact_state(contact, index)
        if moving
        else compute_contact_state(scene, values, contact, state)
        for contact in scene.contacts
    ]
    forces, pushed = np.zeros((scene.mesh.n_vertices, 3)), np.zeros(scene.mesh.n_vertices)
    for each in found:
        forces += each._pushes + each.friction
        pushed += each.normal_force_magnitudes
    return ContactLoads(forces, pushed)
