"""Tests of the execution of starts: own processes, pools of the caller, dask; deaths, interruptions, time limits."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import multistart_runs as runs
import numpy as np
import pytest
import torch
from multistart_runs import STARTS, bits, quiet

import magshell as ms

TESTS = Path(__file__).parents[1] / "support"

# Processes of our own


def test_processes_give_the_bits_of_one_thread(here):
    serial = quiet(runs.valley, STARTS, here)
    assert len({one.objective for one in serial}) > 1  # several minima: the order means something
    starts = torch.tensor(STARTS, dtype=torch.float64)
    assert bits(quiet(runs.valley, starts, workers=2)) == bits(serial)


def test_each_worker_has_one_thread():
    places = [one.result[1] for one in quiet(runs.threads_here, range(2), workers=1)]
    assert places[0] == places[1] and places[0][:3] == (1, 1, ["1", "1"]) and places[0][3] != os.getpid()


def test_a_scene_goes_to_the_workers_and_gives_the_same_bits(here):
    mesh = ms.meshes.rectangle(0.1, 0.02, cells=(8, 2))
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6)
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    starts = ms.random_starts(3, [1, 0, 0], [4, 0, 1])
    found = [
        quiet(runs.bend, starts, here),
        quiet(partial(runs.bend_in, scene), starts, here),
        quiet(partial(runs.bend_in, scene), starts, workers=1),
    ]
    for other in found[1:]:
        assert_same_bends(other, found[0])


def assert_same_bends(some, others):
    for one, other in zip(some, others, strict=True):
        assert (one.number, one.objective) == (other.number, other.objective)
        np.testing.assert_array_equal(one.result[1], other.result[1])


def test_a_start_whose_worker_dies_is_tried_again(tmp_path):
    found = quiet(partial(runs.killed_the_first_time, tmp_path), range(4), workers=2)
    assert [one.start for one in found] == [0, 1, 2, 3] and not found.failed


def test_a_start_that_kills_its_worker_fails_alone():
    found = quiet(runs.kills_itself_at_one, range(4), workers=2, attempts=2)
    assert [one.start for one in found] == [0, 2, 3]
    (lost,) = found.failed
    assert lost.number == 1 and lost.error == "its process was killed by SIGKILL (out of memory?), 2 times"


def test_a_result_that_does_not_pickle_says_so():
    with pytest.raises(ms.MultistartFailed, match=r"what run returned cannot be pickled.*positions"):
        quiet(runs.returns_what_is_not_sent, [0], workers=1)


SCRIPT = """
import sys
import magshell as ms
{code}
"""


def run_script(code, tmp_path, **options):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.format(code=code))
    pipes = dict(stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return subprocess.Popen([sys.executable, path], env=environment(), **pipes, **options)


def environment():
    places = os.pathsep.join([str(Path(ms.__file__).parents[1]), str(TESTS)])
    return {**os.environ, "PYTHONPATH": places}


def test_a_script_without_a_guard_gets_an_error_and_no_swarm(tmp_path):
    process = run_script("print(ms.multistart(abs, [1, 2], workers=2))", tmp_path)
    out, error = process.communicate(timeout=60)
    assert process.returncode == 1 and out == ""
    assert "ended with exit code 1 before it could begin" in error and 'if __name__ == "__main__":' in error
    assert error.count("was called while a worker process imports this script") == 1


def test_functions_of_a_prompt_are_sent_to_workers(tmp_path):
    pytest.importorskip("cloudpickle")
    lines = ["import magshell as ms", "def run(x): return x * scale", "scale = 2.0"]
    program = "\n".join([*lines, "print(ms.multistart(run, [2.0, 1.0], workers=1).objectives)"])
    done = subprocess.run([sys.executable, "-c", program], env=environment(), capture_output=True, text=True)
    assert done.stdout == "[2. 4.]\n", done.stderr


def test_ctrl_c_in_a_terminal_keeps_what_is_finished(tmp_path):
    code = """
import time
def run(start):
    if start:
        time.sleep(600)
    return float(start)

if __name__ == "__main__":
    try:
        ms.multistart(run, [0, 1, 2, 3], workers=1, checkpoint="kept")
    except ms.Interrupted as error:
        print(error, [one.start for one in error.last_good], error.last_good.unfinished)
"""
    process = run_script(code, tmp_path, cwd=tmp_path, start_new_session=True)
    wait_for(lambda: list(tmp_path.glob("kept/start-*")))
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to parent and worker alike
    out, _ = process.communicate(timeout=20)
    assert out == "interrupted after 1 of 4 starts [0] (1, 2, 3)\n" and process.returncode == 0
    wait_for(lambda: not group_lives(process.pid), 5.0)


def group_lives(number):
    try:
        os.killpg(number, 0)
    except ProcessLookupError:
        return False
    return True


def wait_for(condition, seconds=30.0):
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "nothing came"
        time.sleep(0.02)


# Other executors


def test_a_process_pool_of_the_callers(here):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        starts = ms.random_starts(3, [1, 0, 0], [4, 0, 1])
        assert_same_bends(quiet(runs.bend, starts, pool), quiet(runs.bend, starts, here))
        with pytest.raises(ms.MultistartFailed, match="BrokenProcessPool") as caught:
            quiet(runs.kills_itself_at_one, [0, 2, 1, 3], pool)
        assert set(caught.value.last_good.objectives) <= {0.0, 2.0, 3.0}
        with pytest.raises(ms.MultistartFailed, match="stopped after 0 of 2 starts: BrokenProcessPool"):
            quiet(runs.square, [1, 2], pool)


def test_an_executor_that_is_shut_down():
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    with pytest.raises(ms.MultistartFailed, match="after shutdown"):
        quiet(runs.square, [1, 2], executor)


class Dying:
    """Runs one call, and breaks at the second."""

    def __init__(self):
        self.futures = []

    def submit(self, function, *arguments):
        future = Future()
        self.futures.append(future)
        if len(self.futures) == 1:
            future.set_result(function(*arguments))
        elif len(self.futures) == 2:
            future.set_exception(BrokenExecutor("the cluster is gone"))
        return future


def test_an_executor_that_dies_leaves_what_was_finished():
    executor = Dying()
    with pytest.raises(
        ms.MultistartFailed, match=r"stopped after 1 of 3 starts: .*cluster is gone"
    ) as caught:
        quiet(runs.square, [5.0, 6.0, 7.0], executor)
    assert caught.value.last_good.best.objective == 25.0 and caught.value.last_good.unfinished == (1, 2)
    assert executor.futures[2].cancelled()


def test_ctrl_c_with_the_callers_executor_cancels_what_waits():
    calls = []

    def run(start):
        calls.append(start)
        if start == 1:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1.5)  # until what waits is cancelled, also where the machine is busy
        return start

    with ThreadPoolExecutor(1) as executor, pytest.raises(ms.Interrupted) as caught:
        quiet(run, range(5), executor)
    assert [one.start for one in caught.value.last_good] == [0] and calls == [0, 1]


class PressesCtrlC:
    """Runs a call at once, but the last only once it is asked to, as Ctrl-C came while that was handed out."""

    def __init__(self, calls):
        self._left = calls

    def submit(self, function, *arguments):
        self._left -= 1
        if not self._left:
            self.rest = partial(function, *arguments)
            raise KeyboardInterrupt
        future = Future()
        future.set_result(function(*arguments))
        return future


def test_ctrl_c_while_starts_are_handed_out_keeps_what_has_finished():
    calls = []

    def run(start):
        calls.append(start)
        return start

    executor = PressesCtrlC(3)
    with pytest.raises(ms.Interrupted, match="after 2 of 5 starts") as caught:
        quiet(run, range(5), executor)
    assert [one.start for one in caught.value.last_good] == [0, 1]
    assert executor.rest().failed and calls == [0, 1]  # nobody waits for it any more


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    options = dict(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        yield client


def test_dask_loses_nothing_when_a_worker_is_killed(cluster, here, tmp_path):
    starts = ms.random_starts(8, [1, 0, 0], [4, 0, 1])

    def kill_one():
        wait_for(lambda: len(list(tmp_path.iterdir())) >= 3)
        last = max(tmp_path.iterdir(), key=lambda path: int(path.name.split("-")[1]))
        killed.append(int(last.name.split("-")[0]))
        os.kill(killed[0], signal.SIGKILL)

    killed = []
    killer = threading.Thread(target=kill_one)
    killer.start()
    found = quiet(partial(runs.slow_bend, tmp_path), starts, cluster.get_executor())
    killer.join()
    began = [int(path.name.split("-")[0]) for path in tmp_path.iterdir()]
    assert killed and len(began) > len(starts) and not found.failed and not found.unfinished
    assert_same_bends(found, quiet(runs.bend, starts, here))


def test_dask_takes_local_functions(cluster):
    offset = 2.0
    assert quiet(lambda x: x + offset, [1.0, -1.0], cluster.get_executor()).objectives.tolist() == [1.0, 3.0]


def test_dask_does_not_wait_for_what_cannot_be_sent(cluster):
    with pytest.raises(ms.MultistartFailed, match="what run returned cannot be pickled"):
        quiet(runs.returns_what_is_not_sent, [0], cluster.get_executor())
