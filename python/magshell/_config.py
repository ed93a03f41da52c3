"""What this build of magshell is made of, and how many threads it uses."""

from __future__ import annotations

import numbers

from . import _core


def num_threads() -> int:
    """How many threads magshell's parallel loops use, the caller's included."""
    return _core.num_threads()


def set_num_threads(count: int) -> None:
    """Let magshell's parallel loops use ``count`` threads (at least 1). Results are the same bits for any.

    At first it is the number of processors, at most 8, or ``MAGSHELL_NUM_THREADS`` from the environment.

    >>> set_num_threads(2)
    """
    if isinstance(count, bool) or not isinstance(count, numbers.Integral):
        raise TypeError(f"the number of threads must be an integer, got {count!r}")
    if not 1 <= count <= 1024:
        raise ValueError(f"the number of threads must be between 1 and 1024, got {count}")
    _core.set_num_threads(int(count))


def show_config() -> dict[str, str]:
    """Print, and return, magshell's version, factorizations, libraries, compiler and thread counts.

    >>> config = show_config()  # doctest: +SKIP
    """
    config = {
        "magshell": _core.__version__,
        "factorizations": ", ".join(_core.factor_backends()),
        "threads": str(num_threads()),
        **dict(_core.build_info()),
    }
    width = max(map(len, config))
    for name, value in config.items():
        print(f"{name:>{width}}: {value}")
    return config
