"""Tests of many starts: the order of their results, failures, admissible return values, resuming, and bad input."""

import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from types import ModuleType, SimpleNamespace

import multistart_runs as runs
import numpy as np
import pytest
import torch
from multistart_runs import STARTS, quiet

import magshell as ms

# Order and records


def test_the_best_comes_first(here):
    found = quiet(runs.square, [3.0, -1.0, 2.0, 1.0], here)
    assert [one.number for one in found] == [1, 3, 2, 0]
    assert found.objectives.tolist() == [1.0, 1.0, 4.0, 9.0]
    assert found.best.start == -1.0 and found.best is found[0] and len(found) == 4
    assert "4 of 4 starts" in repr(found) and "start 1: objective 1" in repr(found)


def test_feasible_designs_come_before_all_others(here):
    minima = [
        ms.MinimizeResult([], 1.0, 0.5),
        ms.MinimizeResult([], 3.0, 0.0),
        ms.MinimizeResult([], 0.0, 0.7),
        ms.MinimizeResult([], 2.0, 1e-9),
    ]
    assert [one.number for one in quiet(lambda start: start, minima, here)] == [3, 1, 0, 2]
    assert [one.number for one in quiet(lambda start: (start, 0), minima, here, feasibility=0.6)] == [
        0,
        3,
        1,
        2,
    ]


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.array(2.0), torch.tensor(2.0), (2.0, "more")])
def test_admissible_returns_of_a_run(value, here):
    found = quiet(lambda start: value, [None], here)
    assert found.best.objective == 2.0 and found.best.result is value


@pytest.mark.parametrize(
    ("value", "error"),
    [(None, "must return"), ("one", "must return"), ([1, 2], "must return"), (np.nan, "is NaN")],
)
def test_bad_returns_of_a_run_count_as_failures(value, error, here):
    found = quiet(lambda start: value if start else 0.0, [0, 1], here)
    assert len(found) == 1 and error in found.failed[0].error


def test_a_failed_start_is_no_harm_to_the_others(here):
    found = quiet(runs.fails_at_two, [3, 2, 1], here)
    assert [one.start for one in found] == [1, 3] and not found.unfinished
    (lost,) = found.failed
    assert lost.number == 1 and lost.start == 2 and "ObjectiveFailed: two is too much" in lost.error
    assert "fails_at_two" in lost.traceback and lost.last_good.objective == 7.0
    assert "start 1 failed" in repr(found)


def test_no_start_that_finishes_is_an_error(here):
    message = r"none of 2 starts finished; start 0 failed with(.|\n)*two is too much"
    with pytest.raises(ms.MultistartFailed, match=message) as caught:
        quiet(runs.fails_at_two, [2, 2], here)
    assert len(caught.value.last_good.failed) == 2
    with pytest.raises(ValueError, match="no start has finished: 2 failed"):
        _ = caught.value.last_good.best


def test_starts_are_not_changed_by_their_runs(here):
    start = torch.tensor([2.0, 1.0], dtype=torch.float64, requires_grad=True)

    def run(x):
        return ms.minimize(lambda x: (x**2).sum(), [x], ms.optim.LBFGS([x]))

    found = quiet(run, [start], here)
    assert found.best.objective < 1e-12 and found.best.start is start and start.tolist() == [2.0, 1.0]


def test_bars_of_the_runs_are_not_shown(here, capsys):
    ms.multistart(runs.valley, STARTS[:2], here)
    shown = capsys.readouterr().err
    assert "multistart: 100%" in shown and "best" in shown and "minimize" not in shown
    runs.valley(STARTS[0])
    assert "minimize" in capsys.readouterr().err


def test_threads_are_given_back(here):
    before = ms.num_threads()
    ms.set_num_threads(3)
    try:
        assert quiet(runs.threads_here, [0], here).best.result[1][:2] == (1, 1)
        assert ms.num_threads() == 3
    finally:
        ms.set_num_threads(before)


# Bad input


def test_objects_without_pickle_are_refused_before_any_work():
    for run in (lambda x: x, partial(lambda a, x: x, 1)):
        with pytest.raises(ValueError, match=r"run cannot be sent to a worker process.*top of a module"):
            quiet(run, [1, 2])
    with pytest.raises(ValueError, match="start 1 cannot be sent to a worker process"):
        quiet(runs.square, [1, threading.Lock()])
    with ProcessPoolExecutor(1) as pool, pytest.raises(ValueError, match="run cannot be sent"):
        quiet(lambda x: x, [1], pool)


def test_a_notebook_without_cloudpickle_gets_told(monkeypatch):
    monkeypatch.setitem(sys.modules, "cloudpickle", None)
    monkeypatch.setitem(sys.modules, "__main__", ModuleType("__main__"))
    run = partial(runs.square)
    run.place = "__main__"  # as a function that a notebook defines has it in its pickle
    with pytest.raises(ValueError, match=r"defined in a notebook or at a prompt.*pip install cloudpickle"):
        quiet(run, [1])


@pytest.mark.parametrize(
    ("run", "starts", "options", "message"),
    [
        (runs.square, [], {}, "starts is empty"),
        (runs.square, iter([]), {}, "starts is empty"),
        (runs.square, 3.0, {}, "starts must be several"),
        (runs.square, {"a": 1}, {}, "starts must be several, .* got a dict"),
        (runs.square, np.array(3.0), {}, "starts must be several"),
        (runs.square, torch.tensor(3.0), {}, "starts must be several"),
        (None, [1], {}, "run must be a function"),
        (runs.square, [1], {"executor": 4}, "executor must be .* got 4"),
        (runs.square, [1], {"executor": ThreadPoolExecutor}, "the class ThreadPoolExecutor: call it"),
        (runs.square, [1], {"workers": 0}, "workers must be an integer of at least 1, got 0"),
        (runs.square, [1], {"workers": 1.5}, "workers must be"),
        (runs.square, [1], {"attempts": True}, "attempts must be"),
        (runs.square, [1], {"feasibility": np.nan}, "feasibility"),
        (runs.square, [1], {"resume": True}, "needs the checkpoint"),
    ],
)
def test_bad_input_is_refused(run, starts, options, message):
    with pytest.raises(ValueError, match=message):
        quiet(run, starts, **options)


def test_executors_of_another_kind_are_refused(here):
    with pytest.raises(ValueError, match="workers is for processes made here"):
        quiet(runs.square, [1], here, workers=2)
    client = SimpleNamespace(submit=print, get_executor=print)
    with pytest.raises(ValueError, match=r"client\.get_executor\(\)"):
        quiet(runs.square, [1], client)
