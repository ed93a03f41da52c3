"""Runs the members of a batch over threads, each on one thread of the core, and keeps their errors apart."""

from __future__ import annotations

import concurrent.futures
import numbers
import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from .processors import processors
from .single_thread import one_thread


class Outcome(NamedTuple):
    """The outcome of one member: a result, or the error that it raised, or neither if it was not begun."""

    result: Any = None
    error: BaseException | None = None
    begun: bool = True


def checked_threads(threads: int | None, members: int) -> int:
    """Return how many threads the members of a batch use: by default one a processor, but not more than members.

    Raises ValueError for a number that is no positive integer, or beyond the processors of this process.
    """
    available = processors()
    if threads is None:
        return max(1, min(members, available))
    if isinstance(threads, bool) or not isinstance(threads, numbers.Integral) or threads < 1:
        raise ValueError(f"threads must be a positive integer or None, got {threads!r:.60}")
    if threads > available:
        raise ValueError(
            f"threads must be at most {available}, the processors that this process may use, got {threads}"
        )
    return min(int(threads), members)


class WorkerThreads:
    """Threads that call functions, one for each member of a batch, until `close`. The core uses one thread meanwhile.

    They are started when they are first needed, and again in a process that was forked.
    """

    def __init__(self, count: int):
        self.count = count
        self._executor: ThreadPoolExecutor | None = None
        self._process = 0

    def run(
        self, calls: Sequence[Callable[[], Any]], on_interrupt: Callable[[], None] = lambda: None
    ) -> tuple[list[Outcome], KeyboardInterrupt | None]:
        """Call all functions, and return their outcomes in order, and the interrupt that came meanwhile.

        Ctrl-C calls on_interrupt, and the members go on. A second Ctrl-C leaves out those that have not begun. No
        member is left running.
        """
        work = _Work(calls)
        interrupt: KeyboardInterrupt | None = None
        with one_thread():
            while True:
                try:
                    # Again after an interrupt, which may have come before all threads were asked.
                    asked = [self._ready().submit(work.until_done) for _ in range(self.count)]
                    concurrent.futures.wait(asked)
                    work.ended.wait()
                    break
                except KeyboardInterrupt as stopped:
                    if interrupt is None:
                        on_interrupt()
                    else:
                        work.drop()
                    interrupt = stopped
        return work.outcomes, interrupt

    def close(self) -> None:
        """End the threads once they are idle."""
        if self._executor is not None and self._process == os.getpid():
            self._executor.shutdown()
        self._executor = None

    def _ready(self) -> ThreadPoolExecutor:
        """Return the pool of threads of this process."""
        if self._executor is None or self._process != os.getpid():
            self._executor = ThreadPoolExecutor(self.count, "magshell-member")
            self._process = os.getpid()
        return self._executor


class _Work:
    """The calls that wait, run and have ended; each runs exactly once, on whichever thread takes it."""

    def __init__(self, calls: Sequence[Callable[[], Any]]):
        self._calls = calls
        self._waiting, self._lock = deque(range(len(calls))), threading.Lock()
        self._open = len(calls)
        self.outcomes = [Outcome(begun=False) for _ in calls]
        self.ended = threading.Event()

    def until_done(self) -> None:
        """Call one function after another until none waits."""
        while True:
            try:
                k = self._waiting.popleft()
            except IndexError:
                return
            try:
                self.outcomes[k] = Outcome(self._calls[k]())
            except BaseException as error:  # also Interrupted, which belongs to the member
                self.outcomes[k] = Outcome(error=error)
            self._close(1)

    def drop(self) -> None:
        """Leave out the calls that wait."""
        dropped = 0
        while self._waiting:
            try:
                self._waiting.popleft()
                dropped += 1
            except IndexError:
                break
        self._close(dropped)

    def _close(self, count: int) -> None:
        with self._lock:
            self._open -= count
            if self._open == 0:
                self.ended.set()
