"""Equilibria of many designs or loads of one scene at once, over threads: ms.equilibrium(..., batch=k)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.tensors import is_tensor
from ..._runtime.worker_threads import checked_threads
from ...errors import Interrupted
from ...model.scene.batch_axis import BatchAxis, row_of
from ...model.scene.reshaped import reshaped
from ...model.scene.solve_inputs import Inputs
from ..adjoint.batch import BatchAdjoint, Member, OnThreads, solve_members
from ..adjoint.static import Adjoint
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .equilibrium_batch import EquilibriumBatch
from .single_solve import Search, Solution, arrays_of, find, inputs_of

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

# A function of a member, of its keywords, and of a function of the progress that it calls now and then.
FoundMember = Callable[[int, dict[str, Any], Callable[[float, float], None]], Solution]


def find_batch(
    scene: Scene, arguments: dict[str, Any], members: int, threads: int | None, start: Any, search: Search
) -> EquilibriumBatch:
    """Find the equilibria of all members, with the arguments of ms.equilibrium. Raises ValueError on bad input before any
    solve, Interrupted with those that were found; errors of single solves are in the result."""
    members = count("batch", members)
    checked_threads(threads, members)
    axis = BatchAxis(scene, arguments, members)
    return find_along(axis, scene, threads, from_starts(scene, start, search, members), search)[0]


def from_starts(scene: Scene, start: Any, search: Search, members: int) -> FoundMember:
    """Return the function that finds one member of a batch from its start."""
    starts = starts_of_members(start, members)

    def found(member: int, arguments: dict[str, Any], progress: Callable[[float, float], None]) -> Solution:
        return find(scene, arguments, starts[member], replace(search, progress=progress))

    return found


def find_along(
    axis: BatchAxis, scene: Scene, threads: int | None, found: FoundMember, search: Search | None = None
) -> tuple[EquilibriumBatch, BatchAdjoint]:
    """Find the equilibria of all members of a batch whose values are split, and what computes their gradients.

    found: finds one member. search: of which the progress is reported and the forces that are left out are known.
    """
    search = Search() if search is None else search
    on = OnThreads(scene, checked_threads(threads, axis.members))
    first = axis.arguments(0)[0]  # checked here, as every member would raise the same
    there, first["values"] = reshaped(scene, first["values"])
    inputs_of(there, first, search.ignore_velocity_forces)

    def solve(member: int, check: Callable[[], None]) -> Member:
        keywords, leaves = axis.arguments(member)
        one = found(member, keywords, lambda fraction, residual: check())
        arrays = arrays_of(one.inputs.scene, one.found)
        return Member(one.equilibrium, arrays, Adjoint(one.inputs, one.found), one.inputs.tensors, leaves)

    def missing() -> tuple[np.ndarray, ...]:
        model = scene._model
        return model.points(model.rest_state()), model.edge_rotations(model.rest_state()), np.zeros(0)

    solved = solve_members(on, axis, solve, search.progress, missing)
    points, edge_rotations, driving = solved.arrays
    n_v = scene.mesh.n_vertices
    rest = axis.rest_positions
    members = [
        None
        if one is None
        else replace(
            _member(axis, k, one, n_v, points[k], edge_rotations[k], driving[k]),
            _rest=row_of(rest, k),
        )
        for k, one in enumerate(solved.members)
    ]
    positions = points[:, :n_v] if scene.rigid_parts else points
    batch = EquilibriumBatch(scene, positions, edge_rotations, solved.failed, tuple(members), rest)
    if solved.interrupt is not None:
        done = int(batch.converged.sum())
        told = f"interrupted: {done} of {axis.members} members of the batch were found"
        raise Interrupted(told, batch) from solved.interrupt
    return batch, solved.adjoint


def _member(
    axis: BatchAxis,
    member: int,
    one: Member,
    n_vertices: int,
    points: Any,
    edge_rotations: Any,
    driving: Any,
) -> Equilibrium:
    """Return the equilibrium of one member with its part of the results, connected to the values of the batch."""
    loads = {
        each.name: each.given_to(member)
        for each in axis.values
        if each.owner is None
        and each.name in ("remanent_magnetization", "applied_flux_density")
        and is_tensor(each.value)
    }
    found: Equilibrium = one.result
    return replace(
        found,
        _inputs=_connected(axis, member, one),
        positions=points[:n_vertices],
        edge_rotations=edge_rotations,
        _own_points=points[n_vertices:] if found.scene.rigid_parts else None,
        _driving=driving,
        **loads,
    )


def _connected(axis: BatchAxis, member: int, one: Member) -> Inputs | None:
    """Return the inputs of a member with its parts of the values of the batch as leaves, for solves about its result.

    Leaves that were computed from these parts have no gradient there.
    """
    inputs: Inputs | None = one.result._inputs
    if inputs is None:
        return None
    own = [(tensor, each.given_to(member)) for tensor, each in zip(one.tensors, axis.followed, strict=True)]
    leaves = []
    for leaf in inputs.leaves:
        given = [part for tensor, part in own if tensor is leaf.tensor]
        refusal = leaf.refusal or ("" if given else "it was computed from a value of a batch")
        leaves.append(leaf._replace(tensor=given[0] if given else leaf.tensor, refusal=refusal))
    return inputs.with_leaves(leaves)


def starts_of_members(start: Any, members: int) -> list[Any]:
    """Return the start of each member. Raises ValueError if there is another number of them."""
    several = isinstance(start, EquilibriumSet | EquilibriumBatch)
    if isinstance(start, np.ndarray | list) or is_tensor(start):
        several = np.ndim(start) == 3
    if not several:
        return [start] * members
    if len(start) != members:
        raise ValueError(f"start has {len(start)} members, but batch={members}")
    return [start[k] for k in range(members)]
