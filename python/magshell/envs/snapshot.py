"""What an environment's observation and reward are functions of: one state of a motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._runtime.frozen import immutable
from ..model.results.result_lookup import result_of
from ..model.scene.scene import Scene
from ..solve.dynamics.trajectory import Trajectory


@immutable
@dataclass(frozen=True)
class Snapshot:
    """One state of a motion.

    motion, index: where it is recorded. action: (k,) the values that the actuators have, in their own units, one after
        another. before: the snapshot an action earlier, None at the start of an episode (and of that one itself).

    `snapshot[item]` has what the result says of one body, link or joint in this state, `snapshot[hinge].angle` (without
    full turns, in -pi to pi). With several bodies, rows are those of one after another.
    """

    motion: Trajectory = field(repr=False)
    index: int
    action: np.ndarray
    before: Snapshot | None = field(repr=False, default=None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "action", np.array(self.action))

    @property
    def scene(self) -> Scene:
        """Of the environment."""
        return self.motion.scene

    @property
    def time(self) -> float:
        """s, since the start of the episode."""
        return float(self.motion.times[self.index])

    @property
    def positions(self) -> np.ndarray:
        """(n_v, 3) m."""
        return self.motion.positions[self.index]

    @property
    def velocities(self) -> np.ndarray:
        """(n_v, 3) m/s."""
        return self.motion.velocities[self.index]

    @property
    def displacements(self) -> np.ndarray:
        """(n_v, 3) m, from the rest shape."""
        return self.motion.displacements[self.index]

    @property
    def edge_rotations(self) -> np.ndarray:
        """(n_e,) rad."""
        return self.motion.edge_rotations[self.index]

    @property
    def energy(self) -> float:
        """Kinetic and potential, J."""
        return float(self.motion.energy[self.index])

    @property
    def remanent_magnetization(self) -> Any:
        """A/m, as the scene has it."""
        return self.motion.remanent_magnetization

    @property
    def applied_flux_density(self) -> np.ndarray:
        """(3,) T, the uniform part."""
        return self.motion.applied_flux_density[self.index]

    def strains(self) -> Any:
        """The principal strains of every face of the sheets, Strains; where a solid is alone, what snapshot[solid] says."""
        return self.motion.strains(self.index)

    def stresses(self) -> Any:
        """Returns the stresses of the scene's one body, as snapshot[body].stresses()."""
        return self.motion.stresses(self.index)

    def __getitem__(self, item: Any) -> Any:
        """What it says of one body, link or joint."""
        return result_of(self, item)

    # What results of single bodies and pictures look at.

    @property
    def _own_points(self):
        return None if self.motion._own_points is None else self.motion._own_points[self.index]

    @property
    def _own_velocities(self):
        return None if self.motion._own_velocities is None else self.motion._own_velocities[self.index]

    @property
    def _driving(self):
        return self.motion._driving[self.index]

    @property
    def _load_factors(self) -> np.ndarray:
        return self.motion._load_factors[self.index]

    def _values_at(self, index: int):
        return self.motion._values_at(self.index)

    def _state_at(self, index: int) -> np.ndarray:
        return self.motion._state_at(self.index)
