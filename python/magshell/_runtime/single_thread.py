"""Restricts solves to one thread each where several run in parallel: they keep the order of their sums, and their bits."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .. import _core

# Environment variables that libraries read once, when a new process loads them.
_VARIABLES = (
    "MAGSHELL_NUM_THREADS",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)

_lock = threading.Lock()
_inside = 0
_restore: Callable[[], None] | None = None


@contextmanager
def one_thread() -> Iterator[None]:
    """Run magshell and torch on one thread while any thread of this process is inside the block."""
    global _inside, _restore
    with _lock:
        if _inside == 0:
            _restore = _restorer()
        _inside += 1
        _core.set_num_threads(1)
        if "torch" in sys.modules:
            sys.modules["torch"].set_num_threads(
                1
            )  # its OpenMP has a number of threads for each calling thread
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                _restore()


def _restorer() -> Callable[[], None]:
    """Return a function that sets the present numbers of threads again."""
    threads = _core.num_threads()
    torch = sys.modules.get("torch")
    torch_threads = torch.get_num_threads() if torch else 0

    def restore() -> None:
        _core.set_num_threads(threads)
        if torch:
            torch.set_num_threads(torch_threads)

    return restore


@contextmanager
def one_thread_in_children() -> Iterator[None]:
    """Give processes that are started inside the block one thread for each library.

    The block must be short: it changes the environment variables of the whole process.
    """
    with _lock:
        before = {name: os.environ.get(name) for name in _VARIABLES}
        os.environ.update(dict.fromkeys(_VARIABLES, "1"))
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value
