"""Factorizations and iterations of every family stay those of the last release, or counts.json is changed."""

import json

import pytest
from counts import compare, count, measure, missing, read, write

import magshell as ms
from benchmarks.statics import strongly_bent

OLD = {"folds": {"a": [100, 120], "b": [10, 12], "forks": [40, 50, 60, 70]}}


def changed(**cases):
    return {"folds": {**OLD["folds"], **cases}}


def test_counts_of_every_family_are_those_of_the_last_release(capsys):
    """Check that a family's sum grows by at most 5 %, a case by at most half.

    `python tests/hard/counts.py --write` writes the file anew.
    """
    last = read()
    now = measure([], shown=lambda line: None)
    lines, failures = compare(now, last)
    with capsys.disabled():
        print("".join(f"\n{line}" for line in lines))
    assert failures == []
    assert missing(now, last) == []


def test_equal_counts_change_nothing():
    assert compare(OLD, OLD) == ([], [])


def test_a_case_that_grows_by_half_passes_and_is_shown():
    lines, failures = compare(changed(b=[15, 12]), OLD)
    assert failures == []
    assert "folds/b: 10 -> 15 factorizations" in lines


def test_a_case_that_grows_by_more_than_half_fails():
    failures = compare(changed(b=[16, 12]), OLD).failures
    assert failures == [
        "folds/b: 16 factorizations, 10 in the last release (at most half more)",
        *failures[1:],
    ]


def test_a_family_that_grows_by_more_than_five_percent_fails():
    assert compare(changed(a=[105, 120]), OLD).failures == []
    assert compare(changed(a=[106, 120]), OLD).failures == [
        "folds: 116 factorizations in all, 110 in the last release (at most 5 % more)"
    ]


def test_a_case_that_forks_by_rounding_is_held_to_its_largest_count_and_left_out_of_sums():
    assert compare(changed(forks=[90, 105]), OLD).failures == []
    assert len(compare(changed(forks=[91, 105]), OLD).failures) == 1


def test_a_case_that_is_not_in_the_file_fails():
    assert "folds/c: not in counts.json" in compare(changed(c=[1, 1]), OLD).failures[0]
    assert missing({"folds": {"a": [1, 1]}}, OLD) == ["folds/b", "folds/forks"]


def test_the_file_is_written_with_a_case_a_line(tmp_path):
    path = tmp_path / "counts.json"
    write(OLD, path)
    assert read(path) == OLD
    assert json.loads(path.read_text())["magshell"] == ms.__version__
    assert sum('"' in line and "[" in line for line in path.read_text().splitlines()) == 3


def test_solves_are_counted_failed_ones_too():
    scene, load_parameters = strongly_bent(32)
    found = ms.equilibrium(scene, **load_parameters)

    def twice_and_then_too_far():
        for _ in range(2):
            ms.equilibrium(scene, **load_parameters)
        with pytest.raises(ms.NotConverged):
            ms.equilibrium(
                scene, solver=ms.MixedNewton(max_iterations=1, max_relaxation_steps=1), **load_parameters
            )

    assert count(twice_and_then_too_far)[0] >= 2 * found.factorizations
