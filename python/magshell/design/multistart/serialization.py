"""What goes to another process must pickle, and be found again there: said before any work is done."""

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
    """The pickled value. Raises ValueError, naming it, where it does not pickle or could not be unpickled."""
    try:
        contents = pickle.dumps(value)
    except Exception as error:
        raise ValueError(f"{name} cannot be sent to a worker process: {error}. {_REMEDY}") from error
    if b"__main__" in contents and not _main_can_be_imported():
        return _packed_by_value(name, value)
    return contents


def refuse_while_importing(function: str) -> None:
    """Raises RuntimeError in a worker process that is just importing the script it was started from."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise RuntimeError(
            f"{function} was called while a worker process imports this script, which begins with the script's own "
            f'calls: put them into a function, and call it under `if __name__ == "__main__":`'
        )


def _main_can_be_imported() -> bool:
    """Whether a spawned process finds what `__main__` defines: not what a notebook or a prompt does."""
    main = sys.modules["__main__"]
    if getattr(main, "__spec__", None) is not None:
        return True
    return os.path.exists(getattr(main, "__file__", None) or "")


def _packed_by_value(name: str, value) -> bytes:
    try:
        import cloudpickle
    except ImportError:
        raise ValueError(
            f"{name} is defined in a notebook or at a prompt, where worker processes cannot import it: "
            f"pip install cloudpickle, which sends it along. Or: {_REMEDY[0].lower()}{_REMEDY[1:]}"
        ) from None
    return cloudpickle.dumps(value)
