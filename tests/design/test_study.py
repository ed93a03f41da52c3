"""Studies: tables of a function's outputs, on executors, with failures as rows, and a file to resume from."""

import functools
import json
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from study_runs import cantilever, counted, killed, other, root

import magshell as ms

GRID = {"field": [0.0, 5e-3, 10e-3], "thickness": [1e-3, 2e-3]}


def quiet(function, parameters, executor=None, **options):
    return ms.study(function, parameters, executor or ThreadPoolExecutor(1), progress=False, **options)


def test_grid_has_all_combinations_in_order():
    found = quiet(lambda a, b: 10 * a + b, {"a": (1, 2), "b": np.array([3, 4, 5])})
    assert found.parameters == ("a", "b") and found.outputs == ("output",)
    assert found["output"].tolist() == [13, 14, 15, 23, 24, 25]
    assert [row.number for row in found] == list(range(6)) and len(found) == 6
    assert "6 of 6 points" in repr(found)


def test_results_are_the_same_bits_on_every_executor():
    here = quiet(cantilever, GRID)
    with ProcessPoolExecutor(1) as pool:
        there = quiet(cantilever, GRID, pool)
    own = ms.study(cantilever, GRID, workers=2, progress=False)
    assert here["rise [m]"].tobytes() == there["rise [m]"].tobytes() == own["rise [m]"].tobytes()
    assert here["rise [m]"][0] == pytest.approx(0.0, abs=1e-12)
    assert here["rise [m]"][4] > here["rise [m]"][5] > 1e-4
    assert all(row.outputs["stable"] for row in here)


def test_error_of_the_function_is_a_row():
    found = quiet(root, [{"x": 4.0}, {"x": -1.0}, {"x": 9.0}])
    assert found["output"][[0, 2]].tolist() == [2.0, 3.0] and np.isnan(found["output"][1])
    (lost,) = found.failed
    assert lost.number == 1 and lost.error == "ArithmeticError: -1.0 has no root" and "root" in lost.traceback
    assert "1 failed" in repr(found) and "point 1 failed: ArithmeticError" in repr(found)


def test_process_that_dies_is_a_row():
    found = ms.study(killed, {"x": [1.0, -1.0]}, workers=1, attempts=1, progress=False)
    assert found["output"][0] == 1.0 and "killed by SIGKILL" in found.failed[0].error


def test_table_goes_into_pandas_and_comes_back():
    pandas = pytest.importorskip("pandas")
    table = quiet(root, [{"x": 4.0}, {"x": -1.0}]).to_pandas()
    assert list(table.columns) == ["x", "output", "error", "seconds"] and table.index.name == "point"
    assert table["output"][0] == 2.0 and pandas.isna(table["output"][1]) and table["error"][0] == ""
    again = quiet(root, table[["x"]])
    assert again["output"][0] == 2.0 and len(again.failed) == 1


def test_latin_hypercube_has_one_point_in_every_interval():
    points = ms.latin_hypercube(20, {"a": (1.0, 3.0), "b": (1e3, 1e7)}, logarithmic="b", seed=4)
    a, b = (np.array([point[name] for point in points]) for name in "ab")
    assert sorted(np.floor(20 * (a - 1.0) / 2.0)) == list(range(20))
    assert sorted(np.floor(20 * np.log(b / 1e3) / np.log(1e4))) == list(range(20))
    assert points == ms.latin_hypercube(20, {"a": (1.0, 3.0), "b": (1e3, 1e7)}, logarithmic=["b"], seed=4)
    assert points != ms.latin_hypercube(20, {"a": (1.0, 3.0), "b": (1e3, 1e7)}, logarithmic="b", seed=5)


def test_resume_computes_new_and_failed_points_only(tmp_path):
    calls = tmp_path / "calls"
    calls.mkdir()
    run, file = functools.partial(counted, folder=str(calls)), tmp_path / "study.json"
    first = quiet(run, {"x": [1.0, 2.0]}, checkpoint=file)
    assert len(list(calls.iterdir())) == 2 and first.resumed == ()
    second = quiet(run, {"x": [2.0, 3.0, 1.0]}, checkpoint=file, resume=True)
    assert len(list(calls.iterdir())) == 3 and second.resumed == (0, 2)
    assert second["output"].tolist() == [4.0, 9.0, 1.0] and "2 of them earlier" in repr(second)
    quiet(root, {"x": [4.0, -1.0]}, checkpoint=tmp_path / "roots.json")
    again = quiet(root, {"x": [4.0, -1.0]}, checkpoint=tmp_path / "roots.json", resume=True)
    assert again.resumed == (0,) and len(again.failed) == 1


class Breaks(Executor):
    """An executor that is lost after its first call."""

    def __init__(self):
        self.calls = 0

    def submit(self, function, /, *arguments, **named):
        self.calls += 1
        future = Future()
        if self.calls > 1:
            future.set_exception(BrokenExecutor("the cluster is gone"))
        else:
            future.set_result(function(*arguments, **named))
        return future


def test_broken_executor_leaves_its_rows_in_the_file(tmp_path):
    file = tmp_path / "study.json"
    with pytest.raises(ms.MultistartFailed, match=r"stopped after 1 of 3 points.*cluster is gone") as caught:
        quiet(root, {"x": [1.0, 4.0, 9.0]}, Breaks(), checkpoint=file)
    assert len(caught.value.last_good) == 1 and caught.value.last_good.unfinished == (1, 2)
    assert quiet(root, {"x": [1.0, 4.0, 9.0]}, checkpoint=file, resume=True).resumed == (0,)


def test_interruption_keeps_the_rows_so_far(tmp_path):
    def stopped(x):
        if x > 1:
            raise KeyboardInterrupt
        return x

    class Here(Executor):
        def submit(self, function, /, *arguments, **named):
            future = Future()
            future.set_result(function(*arguments, **named))
            return future

    with pytest.raises(ms.Interrupted, match="interrupted after 1 of 2 points") as caught:
        quiet(stopped, {"x": [1.0, 2.0]}, Here(), checkpoint=tmp_path / "study.json")
    assert caught.value.last_good["output"].tolist() == [1.0]
    rows = json.loads((tmp_path / "study.json").read_text())["rows"]
    assert [row["outputs"] for row in rows] == [{"output": 1.0}]


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (np.zeros(3), "its output is a ndarray"),
        ({}, "returned no output"),
        ({"x": 1.0}, "a name of its own"),
        ({"error": 1.0}, "a name of its own"),
        ({"shape": [1, 2]}, "its shape is a list"),
    ],
)
def test_outputs_that_are_no_numbers_are_failures(returned, message):
    assert message in quiet(lambda x: returned, {"x": [1.0]}).failed[0].error


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({}, "no point"),
        ([], "no point"),
        ({"x": []}, "no point"),
        ({"x": 1.0}, r"several, such as \[1.0\]"),
        ({"x": "abc"}, "several, such as a list"),
        ({"x": [np.nan]}, "must be finite"),
        ({"x": [np.zeros(2)]}, "numbers or texts, got a ndarray"),
        ({"y": [1.0]}, "cannot be called with the parameters y"),
        ({"x": [1.0], "y": [1.0]}, "cannot be called with the parameters x, y"),
        ({"seconds": [1.0]}, "not error or seconds"),
        ({"not a name": [1.0]}, "that of a keyword"),
        ([{"x": 1.0}, {"y": 1.0}], "point 1 has the parameters y"),
        ([1.0], r"point 0 must be \{name: value\}"),
        ("x", "must be {name: values}"),
        (3, "must be {name: values}"),
    ],
)
def test_bad_parameters_are_refused_before_any_work(parameters, message):
    with pytest.raises(ValueError, match=message):
        quiet(root, parameters)


def test_bad_options_are_refused_before_any_work(tmp_path):
    file = tmp_path / "study.json"
    quiet(root, {"x": [1.0]}, checkpoint=file)
    cases = [
        ({"function": 3}, "function must be a function"),
        ({"resume": True}, "resume needs the checkpoint"),
        ({"workers": 2}, "workers is for processes made here"),
        ({"attempts": 0}, "attempts must be an integer"),
        ({"executor": ThreadPoolExecutor}, "call it"),
        ({"checkpoint": file}, "exists already: say resume=True"),
        ({"checkpoint": tmp_path}, "must be a file"),
        ({"checkpoint": tmp_path / "none" / "a.json"}, "in a folder that exists"),
        ({"function": other, "checkpoint": file, "resume": True}, "is of another function"),
    ]
    for options, message in cases:
        given = {"function": root, "parameters": {"x": [1.0]}, "executor": ThreadPoolExecutor(1), **options}
        with pytest.raises(ValueError, match=message):
            ms.study(**given, progress=False)
    file.write_text("{}")
    with pytest.raises(ValueError, match="is not the checkpoint of a study"):
        quiet(root, {"x": [1.0]}, checkpoint=file, resume=True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"count": 0}, "count must be an integer"),
        ({"seed": -1}, "seed must be an integer"),
        ({"bounds": {}}, "bounds must be"),
        ({"bounds": {"a": (2.0, 1.0)}}, "the lower first"),
        ({"bounds": {"a": 2.0}}, "must be \\(lower, upper\\)"),
        ({"logarithmic": "b"}, "which is not in bounds"),
        ({"bounds": {"a": (0.0, 1.0)}, "logarithmic": "a"}, "must be positive"),
    ],
)
def test_bad_hypercubes_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        ms.latin_hypercube(**{"count": 3, "bounds": {"a": (1.0, 2.0)}, **arguments})


def test_unknown_column_names_the_nearest():
    found = quiet(root, {"x": [1.0]})
    with pytest.raises(ValueError, match="nearest names are 'output'"):
        found["outputs"]


def test_picture_shows_families_of_a_grid():
    pytest.importorskip("matplotlib")
    found = quiet(
        lambda a, b, c: {"u [m]": a * b, "name": "x"}, {"a": [1.0, 2.0, 500.0], "b": [1.0, 2.0], "c": [1.0]}
    )
    axes = ms.plot_study(found).figure.axes
    assert [each.get_xlabel() for each in axes] == ["a", "b"] and axes[0].get_ylabel() == "u [m]"
    assert [line.get_label() for line in axes[0].get_lines()] == ["b = 1", "b = 2"]
    assert axes[0].get_xscale() == "log" and axes[1].get_xscale() == "linear"
    assert axes[0].get_lines()[1].get_ydata().tolist() == [2.0, 4.0, 1000.0]


def test_picture_marks_failed_points():
    pytest.importorskip("matplotlib")
    found = quiet(root, [{"x": 4.0}, {"x": -1.0}])
    (axes,) = ms.plot_study(found, "output", against="x").figure.axes
    assert axes.get_lines()[-1].get_xdata().tolist() == [-1.0] and axes.get_lines()[-1].get_marker() == "x"


def test_pictures_of_nothing_are_refused():
    pytest.importorskip("matplotlib")
    found, lost = quiet(root, {"x": [1.0]}), quiet(root, {"x": [-1.0]})
    cases = [
        ((3,), {}, "study must be a Study"),
        ((lost,), {}, "1 of its points failed"),
        ((found, "outptu"), {}, "nearest names are 'output'"),
        ((found,), {"against": "y"}, "for against"),
        ((found, []), {}, "a name or a list of names"),
        ((quiet(lambda x: "a", {"x": [1.0]}), "output"), {}, "is not a number"),
    ]
    for arguments, options, message in cases:
        with pytest.raises(ValueError, match=message):
            ms.plot_study(*arguments, **options)
