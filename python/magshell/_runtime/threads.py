"""Number of threads that magshell uses, and the configuration of this build."""

from __future__ import annotations

import numbers
import os

from .. import _core
from .processors import MOST_THREADS, first_threads

_core.set_num_threads(first_threads(os.environ))


def num_threads() -> int:
    """Return the number of threads that magshell's parallel loops use, the calling one included.

    >>> import magshell as ms
    >>> ms.num_threads() >= 1
    True
    """
    return _core.num_threads()


def set_num_threads(count: int) -> None:
    """Let magshell's parallel loops use ``count`` threads (at least 1). Results are the same bits for any.

    At first it is ``MAGSHELL_NUM_THREADS`` from the environment. Without that, it is the number of processors that this
    process may use, by its affinity and the quotas of its control groups, and at most ``OMP_NUM_THREADS`` or, where
    nothing is said, 8. The caller works on every loop itself; the others help where they have a processor to
    themselves, and leave loops alone for a while where they do not.

    >>> set_num_threads(2)
    """
    if isinstance(count, bool) or not isinstance(count, numbers.Integral):
        raise TypeError(f"the number of threads must be an integer, got {count!r}")
    if not 1 <= count <= MOST_THREADS:
        raise ValueError(f"the number of threads must be between 1 and {MOST_THREADS}, got {count}")
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
