"""Tests on a dask scheduler and two workers, each a process of its own, over TCP; one worker is killed in the middle."""

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import multistart_runs as runs
import numpy as np
import pytest
from multistart_runs import quiet

import magshell as ms

distributed = pytest.importorskip("distributed")

SUPPORT = Path(__file__).parents[1] / "support"
PATIENCE = 120.0  # [s] for processes on a busy machine to come up


def started(*arguments):
    path = os.pathsep.join(filter(None, (str(SUPPORT), os.environ.get("PYTHONPATH"))))
    environment = {**os.environ, "PYTHONPATH": path, "MAGSHELL_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


@pytest.fixture
def cluster(tmp_path):
    """Yield a client of a scheduler with two workers."""
    address = ["--scheduler-file", str(tmp_path / "scheduler.json"), "--no-dashboard"]
    local = ["--local-directory", str(tmp_path)]
    processes = [started("scheduler", "--host", "127.0.0.1", "--port", "0", *address)]
    try:
        processes += [started("worker", "--no-nanny", "--nthreads", "1", *address, *local) for _ in range(2)]
        with distributed.Client(scheduler_file=address[1], timeout=PATIENCE) as client:
            client.wait_for_workers(2, timeout=PATIENCE)
            yield client
    finally:
        for each in processes:
            each.kill()
            each.wait()


def kill_a_worker_that_began(folder, began):
    """Send SIGKILL to the process that began last, once so many pieces of work have begun; each wrote a file."""
    until = time.monotonic() + PATIENCE
    while len(found := list(folder.iterdir())) < began:
        if time.monotonic() > until:
            raise TimeoutError(f"{len(found)} pieces of work began, not {began}")
        time.sleep(0.01)
    last = max(found, key=lambda path: int(path.name.split("-")[1]))
    os.kill(int(last.name.split("-")[0]), signal.SIGKILL)


@pytest.fixture
def killing(tmp_path):
    """Return a folder; the worker that writes the third file into it is killed."""
    folder = tmp_path / "began"
    folder.mkdir()
    killer = threading.Thread(target=kill_a_worker_that_began, args=(folder, 3))
    killer.start()
    yield folder
    killer.join()


def assert_one_was_killed(client, folder, pieces):
    assert len(client.scheduler_info()["workers"]) == 1
    assert len(list(folder.iterdir())) > pieces  # at least one piece of work began twice
    assert client.scheduler.address.startswith("tcp://")


def test_batches_of_designs_lose_nothing_with_a_worker(cluster, killing):
    designs = np.random.default_rng(0).uniform(1.0, 4.0, (6, 2, 3))
    executor = cluster.get_executor()
    found = list(executor.map(partial(runs.slow_batch, str(killing)), designs))
    assert_one_was_killed(cluster, killing, len(designs))
    for positions, each in zip(found, designs, strict=True):
        np.testing.assert_array_equal(positions, runs.bend_batch(each))


def test_starts_lose_nothing_with_a_worker_and_are_stored(cluster, killing, tmp_path):
    starts = ms.random_starts(6, [1, 0, 0], [4, 0, 1])
    run = partial(runs.slow_bend, str(killing))
    found = quiet(run, starts, cluster.get_executor(), checkpoint=tmp_path / "starts")
    assert_one_was_killed(cluster, killing, len(starts))
    assert not found.failed and not found.unfinished
    assert len(list((tmp_path / "starts").glob("start-*.npz"))) == len(starts)
    for one in found:
        energy, positions = runs.bend(starts[one.number])
        assert one.objective == energy
        np.testing.assert_array_equal(one.result[1], positions)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_episodes_lose_nothing_with_a_worker(cluster, killing):
    pytest.importorskip("gymnasium")
    waves = np.random.default_rng(1).uniform(-1.0, 1.0, (6, 3, 3))
    make = partial(runs.slow_strip, str(killing))
    found = ms.envs.episodes(make, waves, executor=cluster.get_executor())
    assert_one_was_killed(cluster, killing, 2)
    for one, expected in zip(found, ms.envs.episodes(runs.strip, waves), strict=True):
        np.testing.assert_array_equal(one.observations, expected.observations)
        np.testing.assert_array_equal(one.rewards, expected.rewards)
