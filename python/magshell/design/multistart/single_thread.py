"""One thread for each start: the processors are shared out by starts, and sums keep their order and so their bits."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ... import _core

# What a library reads when a new process loads it; afterwards most of them cannot be asked any more.
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
    """While any thread of this process is inside, magshell and torch run on one thread."""
    global _inside, _restore
    with _lock:
        if _inside == 0:
            _restore = _restorer()
        _inside += 1
        _core.set_num_threads(1)
        if "torch" in sys.modules:
            sys.modules["torch"].set_num_threads(1)  # its OpenMP keeps a number for each calling thread
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                _restore()


def _restorer() -> Callable[[], None]:
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
    """Processes that are started inside have one thread a library. Not for long: it is the environment of all."""
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
