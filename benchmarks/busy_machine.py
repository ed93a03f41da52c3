"""Cost or gain of two threads beside other programs: a motion on two processors, alone and beside other processes."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from statistics import median
from typing import Any

import magshell as ms

from .motion_costs import drive, strip
from .ratios import note
from .report import bar, print_table

CELLS, STEPS, ROUNDS = (48, 12), 40, 9  # 1152 faces
QUICK_CELLS, QUICK_STEPS = (6, 2), 2  # too small to compare with the targets
THREADS = (1, 2)

# {other load: (number of busy programs, number of motions at a time, largest ratio of two threads' time to one's)}.
COMPANY = {
    "alone": (0, 1, None),
    "beside a busy program": (1, 1, 1.15),
    "beside two": (2, 1, 1.15),
    "two motions at once": (0, 2, 1.05),
}

_BUSY = """
import os
parent = os.getppid()
while os.getppid() == parent:
    sum(range(100_000))
"""


def measure(rounds: int) -> dict[str, Any]:
    """Print the table and return its numbers: medians of wall-clock seconds, with one thread and two alternately.

    With 0 rounds it runs one round of a tiny strip, to show the output.
    """
    cells, steps = (CELLS, STEPS) if rounds else (QUICK_CELLS, QUICK_STEPS)
    targets, rounds = rounds > 0, max(1, rounds)
    times = {name: {threads: [] for threads in THREADS} for name in COMPANY}
    with ExitStack() as stack, bar("busy machine", rounds * len(COMPANY)) as shown:
        runners = [stack.enter_context(_runner()) for _ in range(max(n for _, n, _ in COMPANY.values()))]
        for _ in range(rounds):
            for name, (busy, at_once, _) in COMPANY.items():
                with _busy_programs(busy):
                    for threads in THREADS:
                        begun = [each.submit(_seconds, cells, steps, threads) for each in runners[:at_once]]
                        times[name][threads] += map(Future.result, begun)
                shown.update()
    results = {
        "faces": 2 * cells[0] * cells[1],
        "steps": steps,
        "rounds": rounds,
        "company": {
            name: {str(threads): median(seconds) for threads, seconds in each.items()}
            for name, each in times.items()
        },
    }
    _print(results, targets)
    return results


def ratio(times: dict[str, Any]) -> float:
    """Return the time with two threads over that with one."""
    return times["2"] / times["1"]


def _seconds(cells: tuple[int, int], steps: int, threads: int) -> float:
    ms.set_num_threads(threads)
    began = time.perf_counter()
    drive(_strip(cells), steps, integrator=ms.ImplicitEuler())
    return time.perf_counter() - began


@functools.cache
def _strip(cells: tuple[int, int]) -> ms.Scene:
    return strip(cells)


def _runner() -> ProcessPoolExecutor:
    """Return an executor with one process of its own."""
    return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=_stay_on_two_processors)


def _stay_on_two_processors() -> None:
    """Restrict this process to two processors, where the system allows that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])


@contextmanager
def _busy_programs(count: int) -> Iterator[None]:
    """Run this many busy programs during the block, on the same two processors."""
    chosen = {"preexec_fn": _stay_on_two_processors} if os.name == "posix" else {}
    programs = [subprocess.Popen([sys.executable, "-c", _BUSY], **chosen) for _ in range(count)]
    try:
        if programs:
            time.sleep(0.1)  # until they run
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def _print(results: dict[str, Any], targets: bool) -> None:
    rows = []
    for name, (_, _, allowed) in COMPANY.items():
        times = results["company"][name]
        missed = ""
        if targets:
            missed = note("share", f"two threads' time over one's, {name}", ratio(times), at_most=allowed)
        rows.append(
            [
                name,
                "",
                *(f"{1e3 * times[str(threads)]:.0f}" for threads in THREADS),
                f"{ratio(times):.2f}{missed}",
                f"{allowed:g}" if allowed else "",
            ]
        )
    print_table(
        f"A motion of {results['faces']} faces, {results['steps']} steps, on two processors: milliseconds by the clock on "
        f"the wall, medians of {results['rounds']}",
        ["company", "", "one thread", "two threads", "ratio", "at most"],
        rows,
    )
