"""Times of short calls on a noisy machine: several rounds, the best and the median of them."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import magshell as ms


class Timing(NamedTuple):
    """Seconds a call."""

    best: float
    median: float


def measure(call: Callable[[], object], *, rounds: int = 7, seconds: float = 0.1) -> Timing:
    """`rounds` rounds of about `seconds` each, after one call that warms up.

    On one thread the processor's time counts, which other people's work disturbs less; on several, the clock's.
    """
    clock = time.process_time if ms.num_threads() == 1 else time.perf_counter
    call()
    began = clock()
    call()
    repeats = max(1, round(seconds / max(clock() - began, 1e-6)))
    times = []
    for _ in range(rounds):
        began = clock()
        for _ in range(repeats):
            call()
        times.append((clock() - began) / repeats)
    return Timing(min(times), statistics.median(times))


def peak_memory() -> int | None:
    """The largest resident set of this process so far, bytes; None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident_memory() -> int | None:
    """The resident set of this process now, bytes; None where the system does not tell (Linux does)."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE")
