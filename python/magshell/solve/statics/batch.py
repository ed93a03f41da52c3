"""Equilibria of many designs or loads of one scene at once, over threads: ms.equilibrium(..., batch=k)."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.arrays import count
from ..._input.tensors import dtype_like, is_tensor, like
from ..._runtime.worker_threads import Outcome, WorkerThreads, checked_threads
from ...errors import Interrupted, NoGradient, NotConverged
from ...model.scene.batch_axis import BatchAxis, BatchValue
from ..adjoint.static import Adjoint
from .equilibria import EquilibriumSet
from .equilibrium import Equilibrium
from .equilibrium_batch import EquilibriumBatch
from .single_solve import Search, Solution, _arrays, find, inputs_of

if TYPE_CHECKING:
    from ...model.scene.scene import Scene


class _Member(NamedTuple):
    """The solution of one member, its result arrays, and for each of its leaves the number of the followed value."""

    solution: Solution
    arrays: tuple[np.ndarray, ...]
    values: list[int]


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
    members = axis.members
    on = OnThreads(scene, checked_threads(threads, members))
    starts = _starts(start, members)
    inputs_of(scene, axis.arguments(0)[0], search.ignore_velocity_forces)  # raises what every member would
    stopped, finished = threading.Event(), _Progress(search.progress, members)
    members_search = replace(search, progress=_until(stopped))

    def solved(member: int) -> _Member:
        keywords, leaves = axis.arguments(member)
        solution = find(scene, keywords, starts[member], members_search, store_factor=False)
        found = [
            next(j for j, each in enumerate(leaves) if each is leaf.tensor) for leaf in solution.inputs.leaves
        ]
        arrays = _arrays(scene, solution.found)
        finished.one_more(solution.found.residual)
        return _Member(solution, arrays, found)

    outcomes, interrupt = on.call(solved, range(members), stopped)
    found: list[_Member | None] = [each.result for each in outcomes]
    adjoint = BatchAdjoint(on, axis.followed, found)
    batch = _result(scene, axis, outcomes, adjoint)
    if interrupt is not None:
        done = int(batch.converged.sum())
        raise Interrupted(
            f"interrupted: {done} of {members} members of the batch were found", batch
        ) from interrupt
    for k, error in batch.failed.items():
        if not isinstance(error, NotConverged):
            raise _of_member(error, k, members)
    return batch, adjoint


class OnThreads:
    """Calls functions of members of a batch on threads that have a core model of the scene each."""

    def __init__(self, scene: Scene, threads: int):
        self._scene, self.threads = scene, threads

    def call(
        self, function: Callable[[int], Any], members: Sequence[int], stopped: threading.Event | None = None
    ) -> tuple[list[Outcome], KeyboardInterrupt | None]:
        """Call a function for each member, and return the outcomes and the interrupt that came meanwhile.

        stopped: set on Ctrl-C; members that have not begun are then left out.
        """
        stopped = threading.Event() if stopped is None else stopped
        idle: queue.SimpleQueue[Any] = queue.SimpleQueue()
        for core in self._scene._cores.several(self.threads):
            idle.put(core)

        def called(member: int) -> Any:
            if stopped.is_set():
                raise Interrupted("interrupted before it began")
            core = idle.get()
            try:
                with self._scene._cores.chosen(core):
                    return function(member)
            except KeyboardInterrupt as error:
                if isinstance(error, Interrupted):
                    raise
                raise Interrupted("interrupted") from error
            finally:
                idle.put(core)

        workers = WorkerThreads(self.threads)
        try:
            return workers.run([lambda member=each: called(member) for each in members], stopped.set)
        finally:
            workers.close()


class BatchAdjoint:
    """The gradients of a batch of equilibria by its values, member by member over threads."""

    def __init__(self, on: OnThreads, values: list[BatchValue], members: list[_Member | None]):
        self._on, self.values, self._members = on, values, members

    @property
    def n_driving(self) -> int:
        """The number of forces of motors among the results."""
        return next((len(each.arrays[2]) for each in self._members if each is not None), 0)

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted values, each in its shape. Raises NoGradient where there is none."""

        def of(member: int) -> list[np.ndarray | None]:
            one = self._members[member]
            by_member = [np.ascontiguousarray(each[member]) for each in by_outputs]
            if one is None:
                if any(np.any(each) for each in by_member):
                    raise NoGradient(f"no gradient of member {member} of the batch, whose solve failed")
                return []
            adjoint = Adjoint(one.solution.inputs, one.solution.found)
            return adjoint.gradients(by_member, [wanted[k] for k in one.values])

        totals = [
            np.zeros(np.shape(each.numbers)) if asked else None
            for each, asked in zip(self.values, wanted, strict=True)
        ]
        for k, (one, found) in enumerate(zip(self._members, self._all(of), strict=True)):
            for number, part in zip(one.values if one else [], found, strict=True):
                total = totals[number]
                if part is not None and total is not None:
                    self.values[number].add(total, k, part)
        return totals

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of all results along changes of all values. Raises NoGradient where there are none."""

        def of(member: int) -> list[np.ndarray]:
            one = self._members[member]
            if one is None:
                raise NoGradient(f"no tangent of member {member} of the batch, whose solve failed")
            changes = [
                replace(value, numbers=np.asarray(change))
                for value, change in zip(self.values, along, strict=True)
            ]
            adjoint = Adjoint(one.solution.inputs, one.solution.found)
            return adjoint.tangents([np.asarray(changes[k].of(member)) for k in one.values])

        return [np.stack(each) for each in zip(*self._all(of), strict=True)]

    def _all(self, of: Callable[[int], Any]) -> list[Any]:
        """Return the results of a function of all members. Raises the first error."""
        outcomes, interrupt = self._on.call(of, range(len(self._members)))
        if interrupt is not None:
            raise interrupt
        for each in outcomes:
            if each.error is not None:
                raise each.error
        return [each.result for each in outcomes]


class _Progress:
    """Reports finished members to the function of a solve's progress, from any thread."""

    def __init__(self, report: Callable[[float, float], None] | None, members: int):
        self._report, self._members = report, members
        self._done, self._lock = 0, threading.Lock()

    def one_more(self, residual: float) -> None:
        """Count one more member."""
        with self._lock:
            self._done += 1
            if self._report is not None:
                self._report(self._done / self._members, residual)


def _until(stopped: threading.Event) -> Callable[[float, float], None]:
    """Return a progress function that ends a solve once the event is set."""

    def check(fraction: float, residual: float) -> None:
        if stopped.is_set():
            raise KeyboardInterrupt

    return check


def _result(
    scene: Scene, axis: BatchAxis, outcomes: list[Outcome], adjoint: BatchAdjoint
) -> EquilibriumBatch:
    """Return the batch of what was found, connected to the followed values."""
    found: list[_Member | None] = [each.result for each in outcomes]
    failed = {
        k: (each.error or Interrupted("interrupted before it began")).with_traceback(None)
        for k, each in enumerate(outcomes)
        if found[k] is None
    }
    points, edge_rotations, driving = _outputs(scene, axis, found, adjoint)
    n_v = scene.mesh.n_vertices
    own = bool(scene.rigid_parts)
    given = {each.name: each for each in axis.values if each.owner is None}
    members: list[Equilibrium | None] = []
    for k, one in enumerate(found):
        if one is None:
            members.append(None)
            continue
        loads = {
            name: given[name].given_to(k)
            for name in ("remanent_magnetization", "applied_flux_density")
            if name in given and is_tensor(given[name].value)
        }
        members.append(
            replace(
                one.solution.equilibrium,
                positions=points[k, :n_v],
                edge_rotations=edge_rotations[k],
                _own_points=points[k, n_v:] if own else None,
                _driving=driving[k],
                **loads,
            )
        )
    return EquilibriumBatch(scene, points[:, :n_v] if own else points, edge_rotations, failed, tuple(members))


def _outputs(
    scene: Scene, axis: BatchAxis, found: list[_Member | None], adjoint: BatchAdjoint
) -> tuple[Any, ...]:
    """Return points, edge rotations and forces of motors of all members, nan for those that failed."""
    model = scene._model
    rest = model.rest_state()
    first = next((each.arrays for each in found if each is not None), None)
    if first is None:
        first = (model.points(rest), model.edge_rotations(rest), np.zeros(0))
    missing = tuple(np.full(np.shape(each), np.nan) for each in first)
    rows = [missing if each is None else each.arrays for each in found]
    arrays = tuple(np.stack(each) for each in zip(*rows, strict=True))
    tensors = [each.value for each in axis.values if is_tensor(each.value)]
    followed = axis.followed
    if not followed:
        return tuple(like(array, *tensors) for array in arrays)
    from ..adjoint.autograd import solved

    return solved(adjoint, arrays, dtype_like(*tensors), [each.value for each in followed])


def _starts(start: Any, members: int) -> list[Any]:
    """Return the start of each member. Raises ValueError if there is another number of them."""
    several = (
        isinstance(start, EquilibriumSet | EquilibriumBatch)
        or np.ndim(getattr(start, "positions", start)) == 3
    )
    if start is None or not several:
        return [start] * members
    if len(start) != members:
        raise ValueError(f"start has {len(start)} members, but batch={members}")
    return [start[k] for k in range(members)]


def _of_member(error: BaseException, member: int, members: int) -> BaseException:
    """Return an error with the number of its member in the message, if its class takes one."""
    if isinstance(error, ValueError):
        return ValueError(f"member {member} of {members}: {error}")
    return error
