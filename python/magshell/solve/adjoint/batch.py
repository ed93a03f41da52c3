"""Solves of the members of a batch over threads, and the gradients of their results member by member."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..._input.tensors import dtype_like, is_tensor, like
from ..._runtime.worker_threads import Outcome, WorkerThreads
from ...errors import DesignRejected, Interrupted, NoGradient
from ...model.scene.batch_axis import BatchAxis, BatchValue

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from .dynamic import MotionAdjoint
    from .response import ResponseAdjoint
    from .static import Adjoint


class Member(NamedTuple):
    """The solution of one member: its result, the arrays of it, and its gradients.

    leaves: the tensors with respect to which the adjoint computes gradients. tensors: the member's tensors in place of the
    batched values that need a gradient; the leaves are these tensors, or were computed from them.
    """

    result: Any
    arrays: tuple[np.ndarray, ...]
    adjoint: Adjoint | MotionAdjoint | ResponseAdjoint
    leaves: list[Any]
    tensors: list[Any]

    def gradients(self, by_arrays: list[np.ndarray]) -> list[np.ndarray | None]:
        """Compute the gradients by `tensors`; None where nothing depends on one. Raises NoGradient."""
        from .autograd import chained

        found = self.adjoint.gradients(by_arrays, [True] * len(self.leaves))
        return chained(self.leaves, self.tensors, found)

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of the arrays along changes of `tensors`. Raises NoGradient."""
        pairs = list(zip(self.tensors, along, strict=True))
        changes = [change for leaf in self.leaves for each, change in pairs if each is leaf]
        if len(changes) < len(self.leaves):
            raise NoGradient(
                "no tangents of a batch by a value from which each member computes other ones before its solve, as a "
                "motion does from a value that varies in time: take torch.func.jvp of single members, or gradients"
            )
        return self.adjoint.tangents(changes)


class Solved(NamedTuple):
    """The members of a batch, None for those that failed, their arrays stacked and connected to the values, the errors of
    those that failed, and the gradients of all."""

    members: list[Member | None]
    arrays: tuple[Any, ...]
    failed: dict[int, BaseException]
    adjoint: BatchAdjoint
    interrupt: KeyboardInterrupt | None


class OnThreads:
    """Calls functions of members of a batch on threads that have a core model of the scene each."""

    def __init__(self, scene: Scene, threads: int):
        self._scene = scene
        self.threads: int = threads

    def call(
        self, function: Callable[[int], Any], members: int, stopped: threading.Event | None = None
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
            return workers.run([lambda member=each: called(member) for each in range(members)], stopped.set)
        finally:
            workers.close()


class BatchAdjoint:
    """The gradients of the results of a batch by its values, member by member over threads."""

    def __init__(self, on: OnThreads, values: list[BatchValue], members: list[Member | None]):
        self._on, self._members = on, members
        self.values: list[BatchValue] = values

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted values, each in its shape. Raises NoGradient where there is none."""

        def of(member: int) -> list[np.ndarray | None]:
            one = self._members[member]
            by_member = [np.ascontiguousarray(each[member]) for each in by_outputs]
            if one is not None:
                return one.gradients(by_member)
            if any(np.any(each) for each in by_member):
                raise NoGradient(f"no gradient of member {member} of the batch, whose solve failed")
            return []

        totals = [
            np.zeros(np.shape(each.numbers)) if asked else None
            for each, asked in zip(self.values, wanted, strict=True)
        ]
        for k, found in enumerate(self._all(of)):
            for value, total, part in zip(self.values, totals, found or [None] * len(totals), strict=True):
                if part is not None and total is not None:
                    value.add(total, k, part)
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
            return one.tangents([np.asarray(each.of(member)) for each in changes])

        return [np.stack(each) for each in zip(*self._all(of), strict=True)]

    def _all(self, of: Callable[[int], Any]) -> list[Any]:
        """Return the results of a function of all members. Raises the first error."""
        outcomes, interrupt = self._on.call(of, len(self._members))
        if interrupt is not None:
            raise interrupt
        for each in outcomes:
            if each.error is not None:
                raise each.error
        return [each.result for each in outcomes]


def solve_members(
    on: OnThreads,
    axis: BatchAxis,
    solve: Callable[[int, Callable[[], None]], Member],
    report: Callable[[float, float], None] | None,
    missing: Callable[[], tuple[np.ndarray, ...]],
    failures: tuple[type[BaseException], ...] = (DesignRejected, Interrupted),
    further: Sequence[BatchValue] = (),
) -> Solved:
    """Solve all members over threads and stack their results.

    solve: function of a member, and of a function that raises KeyboardInterrupt once the batch is to end, which a solve
    calls now and then. report: called with the fraction of the members that are done. missing: the arrays that
    stand for a member if all fail. failures: the errors by which a member fails; any other one is raised. further: values
    besides those of the axis by which gradients are computed, before these among the tensors of a member.
    """
    stopped, lock, done = threading.Event(), threading.Lock(), [0]

    def check() -> None:
        if stopped.is_set():
            raise KeyboardInterrupt

    def solved(member: int) -> Member:
        found = solve(member, check)
        with lock:
            done[0] += 1
            if report is not None:
                report(done[0] / axis.members, float(getattr(found.result, "residual", 0.0)))
        return found

    outcomes, interrupt = on.call(solved, axis.members, stopped)
    members: list[Member | None] = [each.result for each in outcomes]
    failed = {
        k: (each.error or Interrupted("interrupted before it began")).with_traceback(None)
        for k, each in enumerate(outcomes)
        if each.result is None
    }
    for k, error in failed.items():
        if not isinstance(error, failures):
            raise (
                ValueError(f"member {k} of {axis.members}: {error}")
                if isinstance(error, ValueError)
                else error
            )
    adjoint = BatchAdjoint(on, [*(each for each in further if each.followed), *axis.followed], members)
    values = [*further, *axis.values]
    return Solved(members, _stacked(values, members, adjoint, missing), failed, adjoint, interrupt)


def _stacked(
    values: list[BatchValue],
    members: list[Member | None],
    adjoint: BatchAdjoint,
    missing: Callable[[], tuple[np.ndarray, ...]],
) -> tuple[Any, ...]:
    """Return the arrays of all members, nan for those that failed, connected to the values of the batch."""
    first = next((each.arrays for each in members if each is not None), None)
    of_failed = tuple(np.full(np.shape(each), np.nan) for each in (missing() if first is None else first))
    rows = [of_failed if each is None else each.arrays for each in members]
    arrays = tuple(np.stack(each) for each in zip(*rows, strict=True))
    tensors = [each.value for each in values if is_tensor(each.value)]
    if not adjoint.values:
        return tuple(like(array, *tensors) for array in arrays)
    from .autograd import solved

    return solved(adjoint, arrays, dtype_like(*tensors), [each.value for each in adjoint.values])
