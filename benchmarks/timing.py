"""Measures times of short calls on a noisy machine: several rounds, the best and the median of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, TypeVar

import magshell as ms

Result = TypeVar("Result")


class Timing(NamedTuple):
    """The best and the median time of a call, s."""

    best: float
    median: float


def measure(call: Callable[[], object], *, rounds: int = 7, seconds: float = 0.1) -> Timing:
    """Measure `rounds` rounds of about `seconds` each, after one call that warms up.

    On one thread this is processor time, which other programs disturb less; on several threads, wall-clock time.
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


class Clocked(NamedTuple):
    """The time of a call by both clocks, s.

    Processor time is steadier beside other programs; only wall-clock time shows the gain of several threads.
    """

    processor: float
    wall: float


SHORT = 0.02  # [s] a shorter call is likely to run undisturbed in some rounds
LONG = 1.0  # [s] a longer call is measured in one round, after one that allocates its memory


def clocked(call: Callable[[], object], *, rounds: int = 3, seconds: float = 0.1) -> Clocked:
    """Return the best of `rounds` rounds of about `seconds` each, by each clock."""
    first = _timed(call, 1)
    repeats = max(1, round(seconds / max(first.wall, 1e-6)))
    runs = [_timed(call, repeats) for _ in range(1 if first.processor > LONG else rounds)]
    return Clocked(min(run.processor for run in runs), min(run.wall for run in runs))


def _timed(call: Callable[[], object], repeats: int) -> Clocked:
    processor, wall = time.process_time(), time.perf_counter()
    for _ in range(repeats):
        call()
    return Clocked((time.process_time() - processor) / repeats, (time.perf_counter() - wall) / repeats)


def with_processor_fraction(call: Callable[[], Result]) -> tuple[Result, float]:
    """Return the call's result, and the fraction of the wall-clock time that this process had the processor.

    Wall-clock times measured inside the call, times this fraction, are those without other programs. It is 1 on
    several threads, and for short calls, a few of which run undisturbed.
    """
    processor, wall = time.process_time(), time.perf_counter()
    result = call()
    processor, wall = time.process_time() - processor, time.perf_counter() - wall
    return result, processor / wall if ms.num_threads() == 1 and wall > SHORT else 1.0


@contextmanager
def processor_clock() -> Iterator[None]:
    """Let solves inside the block measure processor time instead of wall-clock time, on one thread.

    Other programs then do not count. On several threads wall-clock time stays.
    """
    walls = time.perf_counter
    if ms.num_threads() == 1:
        time.perf_counter = time.process_time
    try:
        yield
    finally:
        time.perf_counter = walls


def peak_memory() -> int | None:
    """Return the largest resident memory of this process so far, bytes; None if the system does not report it."""
    own = _status("VmHWM")  # Linux: rusage would include the process that this one was forked from
    if own is not None:
        return own
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident_memory() -> int | None:
    """Return the resident memory of this process now, bytes; None if the system does not report it (Linux does)."""
    return _status("VmRSS")


def _status(name: str) -> int | None:
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith(f"{name}:")]
    return int(found[0][1]) * 1024 if found else None
