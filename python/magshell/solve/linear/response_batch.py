"""Linear responses of one scene to many values or loads at once, over threads: ms.linear_response(..., batch=k)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.tensors import detached
from ..._runtime.frozen import immutable
from ..._runtime.solve_keywords import keywords_of
from ..._runtime.worker_threads import checked_threads
from ...errors import Interrupted
from ...model.results.batch_result import BatchResult
from ...model.scene.batch_axis import BatchAxis, BatchValue, row_of
from ...model.scene.reshaped import reshaped
from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs
from ..adjoint.batch import BatchAdjoint, Member, OnThreads, solve_members
from ..adjoint.mapped import SolvedMap, map_solves
from ..statics.equilibrium import Equilibrium
from .base_state import StiffnessAbout, linear_inputs
from .single_response import LinearResponse, adjoint_of, positions_of_response, responded, result_of_response
from .stiffness import IndefiniteStiffness

if TYPE_CHECKING:
    from ..._input.kinds import Computed


@immutable
@dataclass(frozen=True, repr=False)
class LinearResponseBatch(BatchResult):
    """The linear responses of the k members of a batch, of ms.linear_response(..., batch=k).

    displacements: (k, n_v, 3) m; edge_rotations: (k, n_e) rad; tensors where an input was one. Rows of members that failed
    are nan. failed: {member: the error of its response}: its stiffness is not positive definite. equilibrium: the one about
    which all responses are, or None.

    `batch[k]` is the LinearResponse of a member; of one that failed it raises the error.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(20, 4))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.0)
    >>> load = ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 0, 0.01))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
    >>> bent = ms.linear_response(scene, batch=3, load_factor=[0.5, 1.0, 2.0])
    >>> bent.displacements.shape, bent.failed, round(float(bent[2].displacements[:, 2].max()), 2)
    ((3, 105, 3), {}, 0.08)
    """

    scene: Scene
    displacements: Any
    edge_rotations: Any
    failed: dict[int, Any]
    equilibrium: Equilibrium | None
    _members: tuple[LinearResponse | None, ...] = field(repr=False)
    _rest: Any = field(repr=False, default=None)

    @property
    def positions(self) -> Computed:
        """The positions, (k, n_v, 3) m; accurate for small displacements only."""
        return positions_of_response(self)

    def __getitem__(self, index: int) -> LinearResponse:
        """Return the response of one member, or raise the error that it ended with."""
        return self._member(index)


@immutable
@dataclass(frozen=True)
class MappedResponse:
    """The linear response of one member inside torch.func.vmap.

    displacements: (n_v, 3) m; edge_rotations: (n_e,) rad; tensors that stand for those of all members.
    """

    scene: Scene = field(repr=False)
    displacements: Any = field(repr=False)
    edge_rotations: Any = field(repr=False)


def respond_in_batch(
    scene: Scene,
    equilibrium: Equilibrium | None,
    arguments: dict[str, Any],
    members: int,
    threads: int | None,
) -> LinearResponseBatch:
    """Compute the responses of all members, with the arguments of ms.linear_response. Raises ValueError on bad input before
    any response, Interrupted with those that were found."""
    members = count("batch", members)
    checked_threads(threads, members)
    return _respond_along(BatchAxis(scene, arguments, members), scene, equilibrium, threads)[0]


def map_responses(scene: Scene, equilibrium: Equilibrium | None, arguments: dict[str, Any]) -> MappedResponse:
    """Compute the responses of all members of torch.func.vmap. Raises the error of the first one that fails."""
    if equilibrium is not None and getattr(equilibrium, "_inputs", None) is not None:
        raise ValueError(
            "torch.func.vmap over responses about an equilibrium has no gradient by the tensors that the equilibrium was "
            "found with: find it with numbers, or give batch=k"
        )

    def solve(axis: BatchAxis) -> SolvedMap:
        batch, adjoint = _respond_along(axis, scene, equilibrium, None)
        return SolvedMap((batch.displacements, batch.edge_rotations), batch.failed, adjoint, list)

    displacements, edge_rotations = map_solves(scene, arguments, solve)
    return MappedResponse(scene, displacements, edge_rotations)


def _respond_along(
    axis: BatchAxis, scene: Scene, equilibrium: Equilibrium | None, threads: int | None
) -> tuple[LinearResponseBatch, BatchAdjoint]:
    on = OnThreads(scene, checked_threads(threads, axis.members))
    every: dict[str, Any] = dict.fromkeys(each.name for each in keywords_of("linear_response"))
    first = {**every, **axis.arguments(0)[0]}  # checked here, as every member would raise the same
    there, first["values"] = reshaped(scene, first["values"], no_gradient_with=())
    inputs = linear_inputs(there, equilibrium, first)
    about = None
    if equilibrium is not None:
        with inputs.in_core():
            about = StiffnessAbout(equilibrium)
            about.factorize()
    own = _OwnValues(equilibrium)

    def solve(member: int, check: Callable[[], None]) -> Member:
        check()
        keywords, leaves = axis.arguments(member)
        there, further = own.copied()
        found = responded(scene, there, {**every, **keywords}, about)
        adjoint = adjoint_of(found, there)
        return Member(found, found.arrays, adjoint, adjoint.tensors, [*further, *leaves])

    def missing() -> tuple[np.ndarray, ...]:
        model = scene._model
        return model.positions(model.rest_state()), model.edge_rotations(model.rest_state())

    failures = (IndefiniteStiffness, Interrupted)
    solved = solve_members(on, axis, solve, None, missing, failures, own.values)
    displacements, edge_rotations = solved.arrays
    rest = axis.rest_positions
    members = [
        None
        if one is None
        else result_of_response(one.result, equilibrium, displacements[k], edge_rotations[k], row_of(rest, k))
        for k, one in enumerate(solved.members)
    ]
    batch = LinearResponseBatch(
        scene, displacements, edge_rotations, solved.failed, equilibrium, tuple(members), rest
    )
    if solved.interrupt is not None:
        done = int(batch.converged.sum())
        told = f"interrupted: {done} of {axis.members} members of the batch were found"
        raise Interrupted(told, batch) from solved.interrupt
    return batch, solved.adjoint


class _OwnValues:
    """The tensors that an equilibrium was found with, by which the responses of all members about it have gradients."""

    def __init__(self, equilibrium: Equilibrium | None):
        self._equilibrium = equilibrium
        self._inputs: Inputs | None = None if equilibrium is None else equilibrium._inputs
        leaves = [] if self._inputs is None else self._inputs.leaves
        self._leaves = [
            BatchValue(each.owner, each.name, each.tensor, detached(each.tensor), "shared", True)
            for each in leaves
        ]
        self.values: list[BatchValue] = list(self._leaves)
        if equilibrium is not None:  # its dtype counts
            self.values.append(BatchValue(None, "equilibrium", equilibrium.positions, None, "shared", False))

    def copied(self) -> tuple[Equilibrium | None, list[Any]]:
        """Return the equilibrium with new tensors in place of its own, and these tensors."""
        if self._equilibrium is None or self._inputs is None or not self._leaves:
            return self._equilibrium, []
        tensors = [each.copied(0) for each in self._leaves]
        return replace(self._equilibrium, _inputs=self._inputs.with_tensors(tensors)), tensors
