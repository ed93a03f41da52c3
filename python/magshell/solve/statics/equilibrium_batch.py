"""The result of a batch of equilibria: arrays with a leading axis of its members, and the errors of those that failed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.without_gradient import without_gradient
from ..._runtime.frozen import immutable
from ...model.results.batch_result import BatchOfPositions
from .equilibria import EquilibriumSet
from .equilibrium import INSTEAD_OF_ENERGIES

if TYPE_CHECKING:
    from ..._input.kinds import Computed
    from ...model.scene.scene import Scene
    from .equilibrium import Equilibrium


@immutable
@dataclass(frozen=True, repr=False)
class EquilibriumBatch(BatchOfPositions):
    """The equilibria of the k members of a batch, of ms.equilibrium(..., batch=k).

    positions: (k, n_v, 3) m; edge_rotations: (k, n_e) rad; tensors where an input was one. Rows of members that failed are
    nan. failed: {member: the error that its solve raised}, with its last converged state as `last_good`.

    `batch[k]` is the Equilibrium of a member; of one that failed it raises the error. `batch.equilibria` has those that were
    found, for pictures, tables and files.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> designs = [(2e4, 0, 0), (3e4, 0, 0), (4e4, 0, 0)]
    >>> rest = ms.equilibrium(scene, batch=3, remanent_magnetization=designs, applied_flux_density=(0, 0, 2e-3))
    >>> rest.positions.shape, rest.failed, rest[2].stable
    ((3, 33, 3), {}, True)
    """

    scene: Scene
    positions: Any
    edge_rotations: Any
    failed: dict[int, Any]
    _members: tuple[Equilibrium | None, ...] = field(repr=False)
    _rest: Any = field(repr=False, default=None)

    @property
    def energy(self) -> Computed:
        """The potential energies, (k,) J; nan for members that failed."""
        energies = np.array([np.nan if each is None else each._energy for each in self._members])
        return without_gradient(energies, self.positions, "result.energy", INSTEAD_OF_ENERGIES)

    @property
    def stable(self) -> np.ndarray:
        """The stability of each equilibrium, (k,); False for members that failed."""
        return np.array([each is not None and each.stable for each in self._members])

    @property
    def factorizations(self) -> np.ndarray:
        """The number of factorizations of each member, (k,); zero for members that failed."""
        return np.array([0 if each is None else each.factorizations for each in self._members])

    @property
    def equilibria(self) -> EquilibriumSet:
        """The equilibria that were found, one after another."""
        return EquilibriumSet([self[k] for k in np.flatnonzero(self.converged)])

    def __getitem__(self, index: Any) -> Any:
        """Return the equilibrium of one member, or raise the error of its solve; of a body, its results in all members."""
        if isinstance(index, bool) or not isinstance(index, int | np.integer):
            if self.failed:
                raise ValueError(f"members {sorted(self.failed)} failed: take those of batch.equilibria[...]")
            return self.equilibria[index]
        return self._member(index)
