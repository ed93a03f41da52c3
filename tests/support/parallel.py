"""Hooks for test runs: how many processes there are (pytest-xdist), in which order files go to them, and which tests are
nightly.

Tests that took long when they were last measured (tests/seconds.txt, written by `make seconds`) are marked `nightly`;
`make test` leaves them out. They are measured in time of the processor, which depends little on what else it does. A
fixture that the tests of a file share counts for each of them, as the first one that runs has to build it.
"""

import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

MEMORY_A_PROCESS = 2.5e9  # bytes: the largest test, with torch and a picture in memory
SECONDS = Path(__file__).parents[1] / "seconds.txt"
BEGAN = pytest.StashKey[tuple]()
# Fixture of a file or of all tests -> seconds of the processor that it took to build.
SHARED = pytest.StashKey[dict]()
PROCESSES = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return the number of processes for `-n auto`: one for each usable processor, as far as memory suffices; 0 is
    this one.
    """
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if hasattr(os, "sysconf"):
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        processors = min(processors, int(memory / MEMORY_A_PROCESS))
    return processors if processors > 1 else 0


def name_of(item: pytest.Item) -> str:
    """Return test_file.py::test_name, without folder and parameters, so that a moved file keeps its seconds."""
    return f"{item.path.name}::{getattr(item, 'originalname', item.name)}"


def measured() -> dict[str, tuple[float, bool]]:
    """Return name_of -> (seconds that all of its parameters took together, whether it is nightly) of the listed tests."""
    if not SECONDS.exists():
        return {}
    lines = (line.split() for line in SECONDS.read_text().splitlines() if not line.startswith("#"))
    return {name: (float(seconds), bool(nightly)) for seconds, name, *nightly in lines}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark nightly tests, and sort files for several processes: those that take longest come first, so that all end
    together.
    """
    listed = measured()
    only_quick = config.getoption("markexpr", "") == "not nightly"
    of_file: dict[Path, float] = defaultdict(float)
    seen = set()
    for item in items:
        name = name_of(item)
        seconds, nightly = listed.get(name, (0.0, False))
        if nightly:
            item.add_marker(pytest.mark.nightly)
        if name not in seen and not (nightly and only_quick):
            of_file[item.path] += seconds
        seen.add(name)
    if PROCESSES > 1:
        # Stable: within a file, and among quick ones, as they were.
        items.sort(key=lambda item: -of_file[item.path])


def processor_time() -> float:
    """Return the processor time of this process and of those that it has waited for, s."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request: pytest.FixtureRequest) -> Iterator[object]:
    """Record the seconds that a shared fixture takes, without those on which it depends: pytest builds them before."""
    if fixturedef.scope == "function":
        return (yield)
    began = processor_time()
    try:
        return (yield)
    finally:
        taken = request.config.stash.setdefault(SHARED, {})
        # Once for each of its parameters.
        taken[fixturedef] = taken.get(fixturedef, 0.0) + processor_time() - began


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Record the time at which the test's first fixture is built."""
    item.stash[BEGAN] = processor_time(), dict(item.config.stash.get(SHARED, {}))
    return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Add the seconds of the test and of each shared fixture to pytest's report, for scripts/test_seconds.py."""
    try:
        return (yield)
    finally:
        began, before = item.stash[BEGAN]
        own, taken = processor_time() - began, item.config.stash.get(SHARED, {})
        names = getattr(item, "_fixtureinfo", None)
        shared = {chain[-1] for chain in names.name2fixturedefs.values()} & taken.keys() if names else set()
        own -= sum(taken[each] - before.get(each, 0.0) for each in shared)
        item.user_properties.append(("processor_seconds", round(own, 3)))
        for each in shared:
            item.user_properties.append((f"shared {each.baseid}::{each.argname}", round(taken[each], 3)))
