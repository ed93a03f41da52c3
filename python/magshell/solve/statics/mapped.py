"""Equilibria inside torch.func.vmap: the members of the map are solved as one batch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import is_tensor
from ..._runtime.frozen import immutable
from ...errors import NoGradient
from ...model.results.result_lookup import displacements_of
from ...model.scene.batch_axis import BatchAxis
from ...model.scene.reshaped import given_rest
from ..adjoint.batch import BatchAdjoint
from .batch import find_along
from .single_solve import Search

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


def is_mapped(arguments: dict[str, Any]) -> bool:
    """Return whether a value of a solve is inside torch.func.vmap."""
    tensors = _tensors(arguments)
    if not tensors:
        return False
    from ..adjoint.autograd import is_batched

    return any(is_batched(each) for each in tensors.values())


def find_mapped(scene: Scene, arguments: dict[str, Any], start: Any, search: Search) -> MappedEquilibrium:
    """Find the equilibria of all members of the map. Raises the error of the first member whose solve fails."""
    from ..adjoint.autograd import is_followed_in_map, mapped

    tensors = _tensors(arguments)
    followed = {key: is_followed_in_map(each) for key, each in tensors.items()}
    solves = _Solves(scene, arguments, followed, start, search)
    points, edge_rotations = mapped(solves, list(tensors.values()))
    rest = given_rest(scene, arguments.get("values") or {})
    return MappedEquilibrium(scene, points, edge_rotations, rest)


class _Solves:
    """The batch of solves of a map, and afterwards its gradients."""

    def __init__(
        self,
        scene: Scene,
        arguments: dict[str, Any],
        followed: dict[tuple[Any, str], bool],
        start: Any,
        search: Search,
    ):
        self._scene, self._arguments, self._followed = scene, arguments, followed
        self._start, self._search = start, search
        self._adjoint: BatchAdjoint | None = None
        self._shapes: list[tuple[int, ...]] = []
        self._n_driving = 0

    def solve(self, tensors: list[Any]) -> tuple[Any, ...]:
        """Return positions and edge rotations of all members, of tensors with their axis in front."""
        members = len(tensors[0])
        given = _with(self._arguments, dict(zip(self._followed, tensors, strict=True)))
        axis = BatchAxis(self._scene, given, members, self._followed)
        batch, self._adjoint = find_along(axis, self._scene, None, self._start, self._search)
        for error in batch.failed.values():
            raise error
        self._n_driving = len(batch[0]._driving)
        self._shapes = [tuple(each.shape) for each in tensors]
        return batch.positions, batch.edge_rotations

    def gradients(self, by_results: list[np.ndarray]) -> list[np.ndarray]:
        """Return the gradients by all tensors, zero by those that no transform follows."""
        if self._adjoint is None:
            raise NoGradient("no gradient here: there was no solve before")
        by_positions, by_edge_rotations = by_results
        n_points = self._scene._model.points(self._scene._model.rest_state()).shape[0]
        by_points = np.zeros((len(by_positions), n_points, 3))
        by_points[:, : by_positions.shape[1]] = by_positions
        driving = np.zeros((len(by_positions), self._n_driving))
        values = [(each.owner, each.name) for each in self._adjoint.values]
        found = self._adjoint.gradients([by_points, by_edge_rotations, driving], [True] * len(values))
        by_value = dict(zip(values, found, strict=True))
        return [
            np.zeros(shape) if (part := by_value.get(key)) is None else part
            for key, shape in zip(self._followed, self._shapes, strict=True)
        ]


def _tensors(arguments: dict[str, Any]) -> dict[tuple[Any, str], Any]:
    """Return the tensors among the values of a solve, {(owner or None, name): tensor}."""
    values = arguments.get("values")
    found: dict[tuple[Any, str], Any] = {
        (None, name): value for name, value in arguments.items() if is_tensor(value)
    }
    for owner, named in values.items() if isinstance(values, dict) else ():
        if isinstance(named, dict):
            found |= {(owner, name): value for name, value in named.items() if is_tensor(value)}
    return found


def _with(arguments: dict[str, Any], replaced: dict[tuple[Any, str], Any]) -> dict[str, Any]:
    """Return the values of a solve with some of them replaced."""
    values = {owner: dict(named) for owner, named in (arguments.get("values") or {}).items()}
    given = {**arguments}
    for (owner, name), value in replaced.items():
        if owner is None:
            given[name] = value
        else:
            values[owner][name] = value
    return {**given, "values": values or None}
