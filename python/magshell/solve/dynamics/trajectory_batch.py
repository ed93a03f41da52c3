"""The result of a batch of motions: arrays with a leading axis of its members, and the errors of those that failed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.frozen import immutable
from ...model.results.batch_result import BatchOfPositions

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from .trajectory import Trajectory


@immutable
@dataclass(frozen=True, repr=False)
class TrajectoryBatch(BatchOfPositions):
    """The motions of the k members of a batch, of ms.simulate(..., batch=k).

    times: (n,) s, of the recorded states. positions: (k, n, n_v, 3) m; velocities: (k, n, n_v, 3) m/s; edge_rotations:
    (k, n, n_e) rad; tensors where an input was one. Rows of members that failed are nan. failed: {member: the error that
    its motion raised}, with the motion until then as `last_good`.

    `batch[k]` is the Trajectory of a member; of one that failed it raises the error.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(5, 1))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> moves = ms.simulate(scene, steps=4, time_step=2e-3, batch=3, gravity_factor=[0.5, 1.0, 1.5])
    >>> moves.positions.shape, moves.failed, moves[1].steps_done
    ((3, 5, 12, 3), {}, 4)
    """

    scene: Scene
    times: np.ndarray
    positions: Any
    velocities: Any
    edge_rotations: Any
    failed: dict[int, Any]
    _members: tuple[Trajectory | None, ...] = field(repr=False)
    _rest: Any = field(repr=False, default=None)

    @property
    def energy(self) -> np.ndarray:
        """The kinetic and potential energies together, (k, n) J; nan for members that failed."""
        missing = np.full(len(self.times), np.nan)
        return np.stack([missing if each is None else each.energy for each in self._members])

    def __getitem__(self, index: int) -> Trajectory:
        """Return the motion of one member, or raise the error that it ended with."""
        return self._member(index)
