"""Studies that are written to the disk as they come: chunks, failures, killed processes, and what is refused."""

import signal
import subprocess
import sys
import time
import weakref
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import study_runs
from study_runs import counted, killed, other, root, stream_waves

import magshell as ms
from magshell.design.study import stream
from magshell.design.study.points import point_sequence


def quiet(function, parameters, folder, executor=None, **options):
    return ms.stream_study(
        function, parameters, folder, executor or ThreadPoolExecutor(1), progress=False, **options
    )


@pytest.fixture
def calls(tmp_path):
    folder = tmp_path / "calls"
    folder.mkdir()
    return folder


def test_rows_are_those_of_a_study_in_order(tmp_path):
    grid = {"a": (1, 2), "b": np.array([3, 4, 5]), "unit": ["m"]}
    stored = quiet(lambda a, b, unit: {"sum": 10 * a + b, "unit of it": unit}, grid, tmp_path / "s", chunk=4)
    assert stored["sum"].tolist() == [13, 14, 15, 23, 24, 25] and stored["unit of it"].tolist() == ["m"] * 6
    assert stored["a"].tolist() == [1, 1, 1, 2, 2, 2] and stored["number"].tolist() == list(range(6))
    assert [len(each["error"]) for each in stored.chunks()] == [4, 2]
    assert len(stored) == 6 and stored.finished == (0, 1) and stored.unfinished == ()
    assert "6 of 6 points" in repr(stored) and not stored.failed


def test_arrays_have_the_same_bits_on_every_executor(tmp_path, calls):
    here = stream_waves(tmp_path / "here", str(calls))
    with ProcessPoolExecutor(1) as pool:
        there = stream_waves(tmp_path / "there", str(calls), pool)
    grid = {"x": [0.1 * k for k in range(20)], "folder": [str(calls)]}
    own = ms.stream_study(study_runs.wave, grid, tmp_path / "own", workers=2, chunk=7, progress=False)
    exact = np.sin(np.array([0.1 * k for k in range(20)])[:, None] * np.arange(4.0))
    for stored in (here, there, own):
        assert stored["wave"].tobytes() == exact.tobytes() and stored["square"].shape == (20,)


def test_killed_process_loses_no_chunk_that_was_written(tmp_path, calls):
    folder = tmp_path / "streamed"
    (calls / "hold").touch()
    program = f"import study_runs; study_runs.stream_waves({str(folder)!r}, {str(calls)!r})"
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=Path(study_runs.__file__).parent, start_new_session=True
    )
    try:
        end = time.monotonic() + 300.0
        while not (folder / "chunk-00000002.npz").exists():
            assert process.poll() is None and time.monotonic() < end
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    left = ms.StoredStudy(folder)
    assert left.finished == (0, 1, 2) and len(left) == 9 and left["square"][8] == (0.1 * 8) ** 2
    assert not list(folder.glob(".chunk*"))
    (calls / "hold").unlink()
    for each in calls.iterdir():
        each.unlink()
    written = {k: left.folder.joinpath(f"chunk-{k:08d}.npz").stat().st_mtime_ns for k in left.finished}

    whole = stream_waves(folder, str(calls), resume=True)
    assert len(list(calls.iterdir())) == 11  # points 9 to 19 only
    assert whole.unfinished == () and all(
        whole.folder.joinpath(f"chunk-{k:08d}.npz").stat().st_mtime_ns == time for k, time in written.items()
    )
    single = stream_waves(tmp_path / "single", str(calls))
    for one, two in zip(whole.chunks(), single.chunks(), strict=True):
        assert one.keys() == two.keys() and all(one[name].tobytes() == two[name].tobytes() for name in one)


def test_error_of_the_function_is_in_its_row(tmp_path):
    stored = quiet(root, [{"x": -1.0}, {"x": -2.0}, {"x": 4.0}, {"x": -9.0}], tmp_path / "s", chunk=2)
    assert stored["output"][2] == 2.0 and np.isnan(stored["output"][[0, 1, 3]]).all()
    assert stored.failed[0] == "ArithmeticError: -1.0 has no root" and sorted(stored.failed) == [0, 1, 3]


def test_outputs_of_another_shape_are_never_mixed(tmp_path):
    def ragged(x):
        return np.zeros(int(x))

    stored = quiet(ragged, {"x": [2.0, 3.0]}, tmp_path / "one", chunk=2)
    assert list(stored.failed) == [1] and "those of an earlier point" in stored.failed[1]
    with pytest.raises(ms.MultistartFailed, match="those of another"):
        quiet(ragged, {"x": [2.0, 3.0]}, tmp_path / "two", chunk=1)


def test_chunk_whose_process_dies_is_computed_by_a_later_call(tmp_path):
    stored = ms.stream_study(
        killed, {"x": [1.0, -1.0, 2.0]}, tmp_path / "s", chunk=1, workers=1, attempts=1, progress=False
    )
    assert stored.finished == (0, 2) and stored.unfinished == (1,) and stored["output"].tolist() == [1.0, 2.0]


def test_results_are_let_go_once_they_are_written(tmp_path, monkeypatch):
    monkeypatch.setattr(stream, "_IN_FLIGHT", 8)
    results = []

    class Watching(Executor):
        """Makes calls at once, and watches the arrays of their results."""

        def submit(self, function, *given):
            future = Future()
            outcome = function(*given)
            results.append(weakref.ref(outcome))
            future.set_result(outcome)
            return future

    monitored = []

    def seen(x):
        monitored.append(sum(each() is not None for each in results))
        return np.zeros(1000)

    chunks = 3 * stream._IN_FLIGHT
    quiet(seen, {"x": range(chunks)}, tmp_path / "s", Watching(), chunk=1)
    assert len(results) == chunks and max(monitored) <= stream._IN_FLIGHT + 1
    assert not any(each() is not None for each in results)


def test_combinations_are_made_when_they_are_asked_for():
    points = point_sequence({"x": range(1000), "y": range(1000), "z": range(1000)})
    assert len(points) == 10**9 and points[10**9 - 2] == {"x": 999, "y": 999, "z": 998}
    assert points[1_002_003] == {"x": 1, "y": 2, "z": 3}


def test_interruption_keeps_what_was_written(tmp_path, calls):
    class Interrupts(ThreadPoolExecutor):
        def submit(self, function, run, points, *rest):
            if points[0]["x"] > 0.85:
                raise KeyboardInterrupt
            future = super().submit(function, run, points, *rest)
            future.result()
            return future

    with pytest.raises(ms.Interrupted, match="3 of 7 chunks") as caught:
        stream_waves(tmp_path / "s", str(calls), Interrupts(1))
    assert caught.value.last_good.finished == (0, 1, 2)


def test_bad_input_is_refused_before_any_work(tmp_path):
    grid = {"x": [1.0, 2.0]}
    (tmp_path / "file").write_text("")
    for options, message in (
        ({"chunk": 0}, "chunk must be an integer of at least 1, got 0"),
        ({"folder": tmp_path / "file"}, "folder must be a folder"),
        ({"folder": tmp_path, "resume": True}, "no streamed study"),
        ({"folder": tmp_path}, "is not empty"),
        ({"parameters": {"y": [1.0]}}, "function cannot be called"),
        ({"parameters": {"x": []}}, "no point"),
        ({"parameters": {"x": [np.nan]}}, "must be finite"),
        ({"function": 3}, "function must be a function"),
        ({"workers": 2}, "workers is for processes made here"),
    ):
        given = {"function": root, "parameters": grid, "folder": tmp_path / "new"} | options
        with pytest.raises(ValueError, match=message):
            quiet(**given)
        assert not (tmp_path / "new").exists()


def test_folder_of_another_study_is_refused(tmp_path):
    grid, folder = {"x": [1.0, 2.0]}, tmp_path / "s"
    quiet(root, grid, folder)
    with pytest.raises(ValueError, match="is not empty"):
        quiet(root, grid, folder)
    for function, parameters, chunk, message in (
        (other, grid, 100, "of another function"),
        (root, {"x": [1.0, 3.0]}, 100, "other values"),
        (root, {"x": [1.0]}, 100, "2 points, and this one has 1"),
        (root, grid, 1, "100 points in a chunk, and this one has 1"),
    ):
        with pytest.raises(ValueError, match=message):
            quiet(function, parameters, folder, chunk=chunk, resume=True)
    with pytest.raises(ValueError, match="no column 'outptu'; the nearest names are 'output'"):
        ms.StoredStudy(folder)["outptu"]


def test_damaged_chunk_is_named(tmp_path):
    stored = quiet(root, {"x": [1.0, 2.0, 3.0]}, tmp_path / "s", chunk=2)
    path = tmp_path / "s" / "chunk-00000001.npz"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ValueError, match=r"chunk-00000001\.npz is no chunk .* Delete it to compute it again"):
        stored["output"]
    path.unlink()
    assert quiet(root, {"x": [1.0, 2.0, 3.0]}, tmp_path / "s", chunk=2, resume=True)["output"][2] == 3.0**0.5


def test_calls_of_a_chunk_are_made_once(tmp_path, calls):
    quiet(counted, {"x": [1.0, 2.0, 3.0, 4.0], "folder": [str(calls)]}, tmp_path / "s", chunk=3)
    assert len(list(calls.iterdir())) == 4
