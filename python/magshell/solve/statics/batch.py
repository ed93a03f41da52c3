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
from ..adjoint.batch import BatchAdjoint, Member, OnThreads, solve_members
from ..adjoint.static import Adjoint
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .equilibrium_batch import EquilibriumBatch
from .single_solve import Search, arrays_of, find, inputs_of

if TYPE_CHECKING:
    from ...model.scene.scene import Scene


def find_batch(
    scene: Scene, arguments: dict[str, Any], members: int, threads: int | None, start: Any, search: Search
) -> EquilibriumBatch:
    """Find the equilibria of all members, with the arguments of ms.equilibrium. Raises ValueError on bad input before any
    solve, Interrupted with those that were found; errors of single solves are in the result."""
    members = count("batch", members)
    checked_threads(threads, members)
    return find_along(BatchAxis(scene, arguments, members), scene, threads, start, search)[0]


def find_along(
    axis: BatchAxis, scene: Scene, threads: int | None, start: Any, search: Search
) -> tuple[EquilibriumBatch, BatchAdjoint]:
    """Find the equilibria of all members of a batch whose values are split, and what computes their gradients."""
    on = OnThreads(scene, checked_threads(threads, axis.members))
    starts = _starts(start, axis.members)
    first = axis.arguments(0)[0]  # checked here, as every member would raise the same
    there, first["values"] = reshaped(scene, first["values"])
    inputs_of(there, first, search.ignore_velocity_forces)

    def solve(member: int, check: Callable[[], None]) -> Member:
        keywords, leaves = axis.arguments(member)
        one = find(
            scene, keywords, starts[member], replace(search, progress=lambda fraction, residual: check())
        )
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
            _member(axis, k, one.result, n_v, points[k], edge_rotations[k], driving[k]),
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
    found: Equilibrium,
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
    return replace(
        found,
        positions=points[:n_vertices],
        edge_rotations=edge_rotations,
        _own_points=points[n_vertices:] if found.scene.rigid_parts else None,
        _driving=driving,
        **loads,
    )


def _starts(start: Any, members: int) -> list[Any]:
    """Return the start of each member. Raises ValueError if there is another number of them."""
    several = isinstance(start, EquilibriumSet | EquilibriumBatch)
    if isinstance(start, np.ndarray | list) or is_tensor(start):
        several = np.ndim(start) == 3
    if not several:
        return [start] * members
    if len(start) != members:
        raise ValueError(f"start has {len(start)} members, but batch={members}")
    return [start[k] for k in range(members)]
