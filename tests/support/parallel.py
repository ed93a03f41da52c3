"""Hooks for test runs in several processes (pytest-xdist): how many there are, in which order files go to them, and which
tests run while all others wait.

A test that measures time, or counts threads, is marked `alone`. While it runs, the other processes wait between two tests.
It waits for the tests that run, so files with such tests come after those with long tests.
Tests that took long when they were last measured (tests/seconds.txt, written by `make seconds`) are marked `slow`;
`make quick` leaves them out. They are measured in time of the processor, which depends little on what else it does. A
fixture that the tests of a file share counts for each of them, as the first one that runs has to build it.
"""

import contextlib
import os
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

MEMORY_A_PROCESS = 2.5e9  # bytes: the largest test, with torch and a picture in memory
SECONDS = Path(__file__).parents[1] / "seconds.txt"
BEGAN = pytest.StashKey[tuple]()
SHARED = pytest.StashKey[
    dict
]()  # fixture of a file or of all tests -> seconds of the processor that it took to build
PROCESSES = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return the number of processes for `-n auto`: one for each usable processor, as far as memory suffices; 0 is
    this one.
    """
    if fcntl is None:  # no test could run alone
        return 0
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    count = min(processors, int(memory / MEMORY_A_PROCESS))
    return count if count > 1 else 0


def name_of(item: pytest.Item) -> str:
    """Return test_file.py::test_name, without folder and parameters, so that a moved file keeps its seconds."""
    return f"{item.path.name}::{getattr(item, 'originalname', item.name)}"


def measured() -> dict[str, float]:
    """Return name_of -> seconds that all of its parameters took together, of the tests that are listed."""
    if not SECONDS.exists():
        return {}
    lines = (line.split() for line in SECONDS.read_text().splitlines() if not line.startswith("#"))
    return {name: float(seconds) for seconds, name in lines}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark slow tests, and sort files for several processes: those that take longest come first, so that all end
    together, and those with tests that run alone between them and the quick ones.
    """
    seconds = measured()
    of_file: dict[Path, float] = defaultdict(float)
    seen, with_alone = set(), set()
    for item in items:
        if item.get_closest_marker("alone") is not None:
            with_alone.add(item.path)
        name = name_of(item)
        if name in seconds:
            item.add_marker(pytest.mark.slow)
        if name not in seen:
            of_file[item.path] += seconds.get(name, 0.0)
        seen.add(name)
    if PROCESSES > 1:
        least = 0.5 * min(seconds.values(), default=0.0)
        of_file |= dict.fromkeys(with_alone, least)
        items.sort(
            key=lambda item: -of_file[item.path]
        )  # stable: within a file, and among quick ones, as they were


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node) -> None:
    """Tells a process that xdist starts where the locks are, which all of them share."""
    config = node.config
    if not hasattr(config, "_magshell_locks"):
        config._magshell_locks = tempfile.TemporaryDirectory(prefix="magshell-tests-")
        config.add_cleanup(config._magshell_locks.cleanup)
    node.workerinput["locks"] = config._magshell_locks.name


@contextlib.contextmanager
def locked(folder: Path, alone: bool) -> Iterator[None]:
    """Hold a lock together with others, or alone; while one waits to hold it alone, no other can take it."""
    with open(folder / "door", "w") as door, open(folder / "room", "w") as room:
        fcntl.flock(door, fcntl.LOCK_EX)
        fcntl.flock(room, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(door, fcntl.LOCK_UN)
        try:
            yield
        finally:
            fcntl.flock(
                room, fcntl.LOCK_UN
            )  # as a process that the test forked and left behind would hold it too


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
        taken[fixturedef] = (
            taken.get(fixturedef, 0.0) + processor_time() - began
        )  # once for each of its parameters


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


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Run a test under the lock; fixtures of a file are built under that of the first test that needs them."""
    shared = getattr(item.config, "workerinput", None)
    if shared is None:
        return (yield)
    with locked(Path(shared["locks"]), alone=item.get_closest_marker("alone") is not None):
        return (yield)
