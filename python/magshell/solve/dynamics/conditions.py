"""Keeps what a motion was asked for beside its scene, so that it can be repeated, on finer meshes too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ..._runtime.keywords import FLUX_DENSITY
from ..statics.equilibrium import Equilibrium
from .schedule import AtTimePoints

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs
    from ..options import Newton
    from .motion_inputs import MotionInputs


@dataclass(frozen=True)
class MotionConditions:
    """The keywords of one motion as plain numbers.

    inputs: the values of the scene. load_parameters: {name: (time points, ...)}, at the start and the stages of each step.
    record_every: intervals between recorded states. grid_ends: the numbers of steps after which the intervals of the grid
    end, 0 first. points_of_step: the time points of each step. damping: (n,) N s/m, of the vertices. viscosity: stiffness
    damping [s], Maxwell moduli [-] and times [s]. start: None for the rest shape, an Equilibrium, or the name of the type of
    what was given. velocities: (n_v, 3) m/s, or None. varying: descriptions of the values of objects that changed in time.
    core: the input of the core. substeps: {step: the parts in which it was taken}, (begin, end, by implicit Euler).
    """

    inputs: Inputs
    load_parameters: dict[str, np.ndarray]
    record_every: int
    grid_ends: np.ndarray
    points_of_step: int
    damping: np.ndarray
    viscosity: dict[str, Any]
    start: Any
    velocities: np.ndarray | None
    varying: tuple[str, ...]
    solver: Newton
    core: _core.MotionInput
    substeps: dict[int, Any]

    @classmethod
    def of(cls, given: MotionInputs, found: _core.MotionResult) -> MotionConditions:
        """Return the conditions of a motion from its checked inputs and what the core found."""
        start, n_v = given._given_start, given.inputs.scene.mesh.n_vertices
        known = start is None or isinstance(start, Equilibrium)
        velocity = given.start.velocity
        moves, uniform = known and bool(velocity.any()), given.inputs.scene.has_uniform_field
        return cls(
            inputs=given.inputs.without_tensors(),
            load_parameters={
                name: rows for name, rows in given._load_parameters.items() if uniform or name != FLUX_DENSITY
            },
            record_every=given.record_every,
            grid_ends=given.time_steps.grid_ends,
            points_of_step=len(given.time_points.fractions),
            damping=given._damping[:n_v],
            viscosity=given._law,
            start=start if known else type(start).__name__,
            velocities=given.inputs.scene._model.positions(velocity)[:n_v] if moves else None,
            varying=given.varying,
            solver=given.solver,
            core=given.core,
            substeps=found.substeps,
        )

    def keywords(self, intervals: int) -> dict[str, Any]:
        """Return the load parameters and the viscosity of the first intervals as keywords of ms.simulate."""
        count = self.points_of_step * int(self.grid_ends[intervals])
        in_time = {name: AtTimePoints(rows[:count]) for name, rows in self.load_parameters.items()}
        law, branches = self.viscosity, len(self.viscosity["maxwell_modulus"]) > 0
        return {
            **in_time,
            "stiffness_damping": law["stiffness_damping"],
            "maxwell_modulus": law["maxwell_modulus"] if branches else 0.0,
            "maxwell_time": law["maxwell_time"] if branches else None,
        }
