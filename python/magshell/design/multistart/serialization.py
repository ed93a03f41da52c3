"""Pickles what goes to worker processes, and refuses, before any work, what they could not unpickle."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
from typing import Any

_REMEDY = (
    "Define it at the top of a module that worker processes can import, or pass executor="
    "concurrent.futures.ThreadPoolExecutor(1), which stays in this process"
)


def packed(name: str, value: Any) -> bytes:
    """Return the pickled value. Raises ValueError with its name if it cannot be pickled, or not be unpickled in a
    worker."""
    try:
        contents = pickle.dumps(value)
    except Exception as error:
        raise ValueError(f"{name} cannot be sent to a worker process: {error}. {_REMEDY}") from error
    if b"__main__" in contents and not _main_can_be_imported():
        return _packed_by_value(name, value)
    return contents


def refuse_while_importing(function: str) -> None:
    """Raise RuntimeError in a worker process that is importing the script it was started from."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise RuntimeError(
            f"{function} was called while a worker process imports this script, which begins with the script's own "
            f'calls: put them into a function, and call it under `if __name__ == "__main__":`'
        )


def _main_can_be_imported() -> bool:
    """Return whether a spawned process can import `__main__`: False in a notebook and at a prompt."""
    main = sys.modules["__main__"]
    if getattr(main, "__spec__", None) is not None:
        return True
    return os.path.exists(getattr(main, "__file__", None) or "")


def _packed_by_value(name: str, value) -> bytes:
    """Return the value pickled by cloudpickle, which includes the code of `__main__`. Raises ValueError without
    cloudpickle."""
    try:
        import cloudpickle
    except ImportError:
        raise ValueError(
            f"{name} is defined in a notebook or at a prompt, where worker processes cannot import it: "
            f"pip install cloudpickle, which sends it along. Or: {_REMEDY[0].lower()}{_REMEDY[1:]}"
        ) from None
    return cloudpickle.dumps(value)
