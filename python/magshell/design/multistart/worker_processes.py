"""Worker processes of a multistart: a start that crashes its process leaves the other starts alone."""

from __future__ import annotations

import multiprocessing
import pickle
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from ..._runtime.single_thread import one_thread_in_children

if TYPE_CHECKING:
    from types import TracebackType

_TIME_TO_LEAVE = 1.0  # [s] time that an idle process has to end


class WorkerDied(RuntimeError):
    """An error raised if the process of a start ended early, every time the start was tried."""


class WorkerProcesses(Executor):
    """An executor of at most `count` fresh processes, each with one thread.

    They are spawned, so that no thread or lock is inherited. A process that dies is replaced, and its start is
    tried again in the new one, `attempts` times in all. Calls must be of functions of a module, from bytes to
    bytes.

    On entering the `with` block it starts a first process, and raises WorkerDied if that cannot begin. If an error
    ends the block, it kills all processes.
    """

    def __init__(self, count: int, attempts: int):
        self._attempts, self._killed = attempts, threading.Event()
        self._workers: set[_Worker] = set()
        self._idle: queue.LifoQueue[_Worker | None] = queue.LifoQueue()  # None: may be started
        for _ in range(count):
            self._idle.put(None)
        self._threads = ThreadPoolExecutor(count, "magshell-multistart")  # each waits for one process

    def __enter__(self) -> WorkerProcesses:
        self._idle.get()
        self._idle.put(self._started())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.shutdown(cancel_futures=error is not None)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Submit a call of a module's function with bytes as arguments."""
        return self._threads.submit(self._call, function, arguments)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait until all submitted calls have ended, or with cancel_futures kill every process at once."""
        if cancel_futures:
            self._killed.set()
            for worker in list(self._workers):
                worker.kill()
        self._threads.shutdown(wait=wait, cancel_futures=cancel_futures)
        if wait:
            for worker in self._workers:
                worker.hang_up()
            for worker in self._workers:
                worker.leave()

    def _call(self, function, arguments: tuple[Any, ...]) -> bytes:
        """Call the function in an idle process, again in a new one if the process dies. Raises WorkerDied after the
        last attempt."""
        worker = self._idle.get()
        try:
            for _ in range(self._attempts):
                worker = worker or self._started()
                try:
                    return worker.call(function, arguments)
                except EOFError:
                    how, worker = self._buried(worker), None
                if self._killed.is_set():
                    break
            times = f", {self._attempts} times" if self._attempts > 1 else ""
            raise WorkerDied(f"its process {how}{times}")
        finally:
            self._idle.put(worker)

    def _buried(self, worker: _Worker) -> str:
        """Remove a worker that has died, and say how it ended."""
        self._workers.discard(worker)
        return worker.how_it_ended()

    def _started(self) -> _Worker:
        """Return a new worker that is ready. Raises WorkerDied if it ended before that."""
        worker = _Worker()
        self._workers.add(worker)
        if self._killed.is_set():  # shutdown may not have seen this new worker
            worker.kill()
        try:
            ready = worker.is_ready()
        except BaseException:
            worker.kill()
            raise
        if not ready:
            raise WorkerDied(
                f"a worker process {self._buried(worker)} before it could begin. It printed why. A script must call "
                'ms.multistart under `if __name__ == "__main__":`, because its processes import the script'
            )
        return worker


class _Worker:
    def __init__(self):
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), name="magshell-multistart")
        with one_thread_in_children():
            self._process.start()
        theirs.close()

    def is_ready(self) -> bool:
        """Wait until the process has imported what it needs; returns False if it ended."""
        try:
            return self._connection.recv_bytes() == b"ready"
        except (EOFError, OSError):
            return False

    def call(self, function, arguments: tuple[Any, ...]) -> bytes:
        """Call the function in the process. Raises EOFError if the process dies."""
        try:
            self._connection.send_bytes(pickle.dumps((function, arguments)))
            return self._connection.recv_bytes()
        except OSError as error:
            raise EOFError from error

    def how_it_ended(self) -> str:
        """Return the signal or the exit code with which the process ended, as text."""
        self._process.join()
        code = self._process.exitcode
        if code is not None and code < 0:
            name = signal.Signals(-code).name
            return f"was killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")
        return f"ended with exit code {code}"

    def kill(self) -> None:
        self._process.kill()

    def hang_up(self) -> None:
        self._connection.close()

    def leave(self) -> None:
        """Wait a moment for the process to end by itself, then kill it."""
        self._process.join(_TIME_TO_LEAVE)
        self._process.kill()


def _serve(connection) -> None:
    """Run calls in the worker process, until its parent closes the connection."""
    # Ctrl-C reaches every process of a terminal; only the parent handles it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        connection.send_bytes(b"ready")
        while True:
            function, arguments = pickle.loads(connection.recv_bytes())
            connection.send_bytes(function(*arguments))
    except (EOFError, OSError):
        return
