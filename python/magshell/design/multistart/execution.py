"""Makes many calls on an executor, or in worker processes, and collects their outcomes as they come."""

from __future__ import annotations

import itertools
import numbers
import os
import pickle
import queue
from collections.abc import Callable, Mapping, Sequence
from concurrent import futures
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Any, Protocol

from ..._runtime.broken_pipes import ignore_broken_pipes
from .run_start import CallOff, Outcome, attempt_packed, attempt_sent, failure, this_process
from .serialization import packed
from .worker_processes import WorkerDied, WorkerProcesses


class Work(Protocol):
    """Calls to be made, by number, and the outcomes so far."""

    @property
    def outcomes(self) -> Mapping[int, Any]: ...

    @property
    def unfinished(self) -> list[int]: ...

    def take(self, number: int, outcome: Outcome) -> None: ...

    def summary(self) -> str: ...


def drive(
    work: Work,
    executor: Executor | None,
    task: Callable[..., Any],
    bar: Any,
    workers: int | None = None,
    attempts: int = 1,
    in_flight: int | None = None,
) -> None:
    """Make every unfinished call on an executor, or on processes made here and ended, and store the outcomes.

    task: function of a number and a CallOff that returns the arguments for the executor's `submit`, as `tasks` gives.
    workers, attempts: as in ms.multistart. in_flight: how many calls the executor holds at most; None: all.
    """
    ignore_broken_pipes()  # a process that dies leaves pipes without reader
    if executor is not None:
        _drive(work, executor, task, bar, in_flight)
    elif work.unfinished:
        count = min(workers or _processors(), len(work.unfinished))
        with WorkerProcesses(count, attempts) as own:
            _drive(work, own, task, bar, in_flight)


def _drive(work: Work, executor: Executor, task: Callable[..., Any], bar: Any, in_flight: int | None) -> None:
    """Make every unfinished call, and store the outcomes as they come.

    Ctrl-C may come at any moment, also between the end of a call and the storing of its outcome: finished calls
    are not lost.
    """
    done: queue.SimpleQueue[tuple[int, Future]] = queue.SimpleQueue()
    running: dict[int, Future] = {}
    call_off = CallOff()
    waiting = iter(work.unfinished)

    def submit(count: int | None) -> None:
        for number in itertools.islice(waiting, count):
            running[number] = executor.submit(*task(number, call_off))
            running[number].add_done_callback(lambda future, number=number: done.put((number, future)))

    try:
        submit(in_flight)
        while running:
            number, future = _next(done)
            work.take(number, _outcome(future))
            del running[number]  # with its result
            bar.update()
            bar.set_postfix_str(work.summary())
            submit(1)
    finally:
        call_off.done = True
        for future in running.values():
            future.cancel()
        for number, future in running.items():
            if (
                number not in work.outcomes
                and future.done()
                and not future.cancelled()
                and not future.exception()
            ):
                work.take(number, _outcome(future))


def _next(done: queue.SimpleQueue[tuple[int, Future]]) -> tuple[int, Future]:
    """Return the next future that ends. The waits are short, because Ctrl-C at the beginning of a wait is noticed
    only at its end."""
    while True:
        try:
            return done.get(timeout=0.2)
        except queue.Empty:
            continue


def tasks(
    run: Callable[..., Any],
    starts: Sequence[Any],
    executor: Executor | None,
    labels: tuple[str, str] = ("run", "start"),
    checked: int | None = None,
) -> Callable[[int, CallOff], tuple[Any, ...]]:
    """Return a function that gives what to submit for each start.

    labels: what the run and a start are called in messages. checked: how many starts are tried; None: all. Raises
    ValueError, before any work, if the run or a start cannot be sent to another process.
    """
    if executor is not None and not isinstance(executor, futures.ProcessPoolExecutor):
        return lambda number, call_off: (attempt_sent, run, starts[number], this_process(), call_off)
    contents = packed(labels[0], run)
    for number, start in enumerate(itertools.islice(starts, checked)):
        packed(f"{labels[1]} {number}", start)
    return lambda number, _: (attempt_packed, contents, packed(f"{labels[1]} {number}", starts[number]))


def _outcome(future: Future) -> Outcome:
    """Return the outcome of a start. Raises the error if the executor caused it, and not the start."""
    try:
        outcome = future.result()
        return pickle.loads(outcome) if isinstance(outcome, bytes) else outcome
    except (BrokenExecutor, CancelledError):
        raise
    except WorkerDied as error:
        return Outcome(error=str(error))
    except Exception as error:
        return failure(error)


def in_words(error: Exception) -> str:
    if isinstance(error, CancelledError):
        return "the executor cancelled its work, as one that is closed does"
    return f"{type(error).__name__}: {error}"


def check_executor(executor: Any, workers: Any, attempts: Any) -> None:
    """Raise ValueError for anything but an Executor or None, and for bad numbers of workers and attempts."""
    if hasattr(executor, "get_executor"):
        raise ValueError("executor must be a concurrent.futures.Executor: pass client.get_executor()")
    if isinstance(executor, type) or not (executor is None or callable(getattr(executor, "submit", None))):
        what = (
            f"the class {executor.__name__}: call it" if isinstance(executor, type) else f"{executor!r:.60}"
        )
        raise ValueError(f"executor must be a concurrent.futures.Executor, got {what}")
    if workers is not None and executor is not None:
        raise ValueError("workers is for processes made here: an executor has its own")
    for name, value in (("workers", 1 if workers is None else workers), ("attempts", attempts)):
        if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 1:
            raise ValueError(f"{name} must be an integer of at least 1, got {value!r}")


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
