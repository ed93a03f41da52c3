"""Times of short calls on a noisy machine: several rounds, the best and the median of them."""

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


class Clocked(NamedTuple):
    """Seconds a call by both clocks. Beside other people's work that of the processor is the steadier one; what several
    threads gain shows on the wall's only."""

    processor: float
    wall: float


SHORT = 0.02  # s: what a call may take to be left alone for once
LONG = 1.0  # s: a call that takes longer is measured in one round, after one that takes its memory from the system


def clocked(call: Callable[[], object], *, rounds: int = 3, seconds: float = 0.1) -> Clocked:
    """The best of `rounds` rounds of about `seconds` each, by each clock."""
    first = _timed(call, 1)
    repeats = max(1, round(seconds / max(first.wall, 1e-6)))
    runs = [_timed(call, repeats) for _ in range(1 if first.processor > LONG else rounds)]
    return Clocked(min(run.processor for run in runs), min(run.wall for run in runs))


def _timed(call: Callable[[], object], repeats: int) -> Clocked:
    processor, wall = time.process_time(), time.perf_counter()
    for _ in range(repeats):
        call()
    return Clocked((time.process_time() - processor) / repeats, (time.perf_counter() - wall) / repeats)


def with_share(call: Callable[[], Result]) -> tuple[Result, float]:
    """What it returns, and the share of the wall's time that this process had meanwhile: wall times that were measured
    inside, times this, are what they would have been without other people's work. 1 on several threads, and for short
    calls, of which one in a few goes undisturbed.
    """
    processor, wall = time.process_time(), time.perf_counter()
    result = call()
    processor, wall = time.process_time() - processor, time.perf_counter() - wall
    return result, processor / wall if ms.num_threads() == 1 and wall > SHORT else 1.0


@contextmanager
def processor_clock() -> Iterator[None]:
    """Within it the times that solves measure of themselves are the processor's, on one thread: other people's work does
    not count. On several threads they stay the wall's."""
    walls = time.perf_counter
    if ms.num_threads() == 1:
        time.perf_counter = time.process_time
    try:
        yield
    finally:
        time.perf_counter = walls


def peak_memory() -> int | None:
    """The largest resident set of this process so far, bytes; None where the system does not tell."""
    own = _status("VmHWM")  # Linux: rusage would count what the process was forked from
    if own is not None:
        return own
    try:
        import resource
    except ImportError:
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident_memory() -> int | None:
    """The resident set of this process now, bytes; None where the system does not tell (Linux does)."""
    return _status("VmRSS")


def _status(name: str) -> int | None:
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return None
    found = [line.split() for line in lines if line.startswith(f"{name}:")]
    return int(found[0][1]) * 1024 if found else None
