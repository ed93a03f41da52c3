"""State of a motion that an environment's observation and reward are computed from."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._input.tensors import is_tensor
from .._input.without_gradient import without_gradient
from .._runtime.frozen import immutable
from ..model.results.result_lookup import result_of
from ..model.scene.scene import Scene
from ..solve.dynamics.trajectory import Trajectory


@immutable
@dataclass(frozen=True)
class Snapshot:
    """One state of a motion.

    motion, index: the motion, and the number of this state in it. action: (k,), the values of the actuators in their own
        units, one after another. before: the snapshot one action earlier; None at the start of an episode, and in a
        snapshot that is itself the `before` of another.

    `snapshot[item]` is the result of one body, link or joint in this state, such as `snapshot[hinge].angle` (without full
    turns, in -pi to pi). With several bodies, rows are those of one after another. Positions, velocities, displacements,
    edge rotations and the action are tensors in Environment.differentiable_step.
    """

    motion: Trajectory = field(repr=False)
    index: int
    action: Any
    before: Snapshot | None = field(repr=False, default=None)

    def __post_init__(self) -> None:
        if not is_tensor(self.action):
            object.__setattr__(self, "action", np.array(self.action))

    @property
    def scene(self) -> Scene:
        """The scene of the environment."""
        return self.motion.scene

    @property
    def time(self) -> float:
        """The time since the start of the episode, s."""
        return float(self.motion.times[self.index])

    @property
    def positions(self) -> Any:
        """The positions of the vertices, (n_v, 3) m."""
        return self.motion.positions[self.index]

    @property
    def velocities(self) -> Any:
        """The velocities of the vertices, (n_v, 3) m/s."""
        return self.motion.velocities[self.index]

    @property
    def displacements(self) -> Any:
        """The displacements of the vertices from the rest shape, (n_v, 3) m."""
        return self.motion.displacements[self.index]

    @property
    def edge_rotations(self) -> Any:
        """The rotations of the edges, (n_e,) rad."""
        return self.motion.edge_rotations[self.index]

    @property
    def energy(self) -> Any:
        """The kinetic and potential energy, J."""
        return without_gradient(float(self.motion._energy[self.index]), self.motion.positions, "state.energy")

    @property
    def remanent_magnetization(self) -> Any:
        """The remanent magnetization of the scene, A/m."""
        return self.motion.remanent_magnetization

    @property
    def applied_flux_density(self) -> np.ndarray:
        """The uniform part of the applied field, (3,) T."""
        return self.motion.applied_flux_density[self.index]

    def strains(self) -> Any:
        """Return the principal strains of every face of the sheets, as Strains; for a single solid, those of
        snapshot[solid]."""
        return self.motion.strains(self.index)

    def stresses(self) -> Any:
        """Return the stresses of the scene's one body, as snapshot[body].stresses()."""
        return self.motion.stresses(self.index)

    def __getitem__(self, item: Any) -> Any:
        """Return the result of one body, link or joint in this state."""
        return result_of(self, item)

    # Attributes that results of single bodies and pictures need.

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

    @property
    def _rest(self) -> Any:
        return self.motion._rest

    def _values_at(self, index: int):
        return self.motion._values_at(self.index)

    def _tensors_at(self, index: int) -> dict[tuple[Any, str], Any]:
        return self.motion._tensors_at(self.index)

    def _state_at(self, index: int) -> np.ndarray:
        return self.motion._state_at(self.index)
