"""Solves inside torch.func.vmap: the members of the map are solved as one batch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.tensors import is_tensor
from ...errors import NoGradient
from ...model.scene.batch_axis import BatchAxis
from .batch import BatchAdjoint

if TYPE_CHECKING:
    from ...model.scene.scene import Scene


class SolvedMap(NamedTuple):
    """The results of all members of a map, with their axis in front, and what computes their gradients.

    by_arrays: makes the derivatives by the arrays of the adjoint from those by the results.
    """

    results: tuple[Any, ...]
    failed: Mapping[int, BaseException]
    adjoint: BatchAdjoint
    by_arrays: Callable[[list[np.ndarray]], list[np.ndarray]]


def is_mapped(arguments: dict[str, Any]) -> bool:
    """Return whether a value of a solve is inside torch.func.vmap."""
    tensors = _tensors(arguments)
    if not tensors:
        return False
    from ..adjoint.autograd import is_batched

    return any(is_batched(each) for each in tensors.values())


def map_solves(
    scene: Scene, arguments: dict[str, Any], solve: Callable[[BatchAxis], SolvedMap]
) -> tuple[Any, ...]:
    """Return the results of a batch of solves as tensors inside the map. Raises the error of the first member that fails."""
    from .autograd import is_followed_in_map, mapped

    tensors = _tensors(arguments)
    followed = {key: is_followed_in_map(each) for key, each in tensors.items()}
    return mapped(_Solves(scene, arguments, followed, solve), list(tensors.values()))


class _Solves:
    """The batch of solves of a map, and afterwards its gradients."""

    def __init__(
        self,
        scene: Scene,
        arguments: dict[str, Any],
        followed: dict[tuple[Any, str], bool],
        solve: Callable[[BatchAxis], SolvedMap],
    ):
        self._scene, self._arguments, self._followed, self._solve = scene, arguments, followed, solve
        self._solved: SolvedMap | None = None
        self._shapes: list[tuple[int, ...]] = []

    def solve(self, tensors: list[Any]) -> tuple[Any, ...]:
        """Return the results of all members, of tensors with their axis in front."""
        given = _with(self._arguments, dict(zip(self._followed, tensors, strict=True)))
        self._solved = self._solve(BatchAxis(self._scene, given, len(tensors[0]), self._followed))
        for error in self._solved.failed.values():
            raise error
        self._shapes = [tuple(each.shape) for each in tensors]
        return self._solved.results

    def gradients(self, by_results: list[np.ndarray]) -> list[np.ndarray]:
        """Return the gradients by all tensors, zero by those that no transform follows."""
        if self._solved is None:
            raise NoGradient("no gradient here: there was no solve before")
        adjoint = self._solved.adjoint
        values = [(each.owner, each.name) for each in adjoint.values]
        found = adjoint.gradients(self._solved.by_arrays(by_results), [True] * len(values))
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
