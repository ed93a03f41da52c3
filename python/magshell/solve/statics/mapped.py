"""Equilibria inside torch.func.vmap: the members of the map are solved as one batch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.frozen import immutable
from ...model.results.result_lookup import displacements_of
from ...model.scene.batch_axis import BatchAxis
from ...model.scene.reshaped import given_rest
from ..adjoint.batch import BatchAdjoint
from ..adjoint.mapped import SolvedMap, map_solves
from .equilibrium_batch import EquilibriumBatch

if TYPE_CHECKING:
    from ..._input.kinds import Computed
    from ...model.scene.scene import Scene


@immutable
@dataclass(frozen=True)
class MappedEquilibrium:
    """The equilibrium of one member inside torch.func.vmap.

    positions: (n_v, 3) m; edge_rotations: (n_e,) rad; tensors that stand for those of all members.
    """

    scene: Scene = field(repr=False)
    positions: Any = field(repr=False)
    edge_rotations: Any = field(repr=False)
    _rest: Any = field(repr=False, default=None)

    @property
    def displacements(self) -> Computed:
        """The displacements from the rest shape, (n_v, 3) m."""
        return displacements_of(self)


def find_mapped(
    scene: Scene,
    arguments: dict[str, Any],
    along: Callable[[BatchAxis], tuple[EquilibriumBatch, BatchAdjoint]],
) -> MappedEquilibrium:
    """Find the equilibria of all members of the map by `along`. Raises the error of the first member whose solve fails."""

    def solve(axis: BatchAxis) -> SolvedMap:
        batch, adjoint = along(axis)
        n_driving = max((len(batch[int(k)]._driving) for k in np.flatnonzero(batch.converged)), default=0)

        def by_arrays(by_results: list[np.ndarray]) -> list[np.ndarray]:
            by_positions, by_edge_rotations = by_results
            n_points = scene._model.points(scene._model.rest_state()).shape[0]
            by_points = np.zeros((len(by_positions), n_points, 3))
            by_points[:, : by_positions.shape[1]] = by_positions
            return [by_points, by_edge_rotations, np.zeros((len(by_positions), n_driving))]

        return SolvedMap((batch.positions, batch.edge_rotations), batch.failed, adjoint, by_arrays)

    points, edge_rotations = map_solves(scene, arguments, solve)
    rest = given_rest(scene, arguments.get("values") or {})
    return MappedEquilibrium(scene, points, edge_rotations, rest)
