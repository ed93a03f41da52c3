"""The keywords that solves share: signatures and docstrings agree with the table, and values are checked by it."""

import inspect

import numpy as np
import pytest

import magshell as ms
from magshell._input.keyword_value import keyword_value
from magshell._runtime.solve_keywords import SOLVE_KEYWORDS, keywords_of, names_of

SOLVES = sorted({solve for each in SOLVE_KEYWORDS.values() for solve in each.solves})


def flattened(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize("solve", SOLVES)
def test_signature_has_the_keywords_and_defaults_of_the_table(solve) -> None:
    parameters = inspect.signature(getattr(ms, solve)).parameters
    rows = {each.name: each for each in keywords_of(solve)}
    assert {name for name in parameters if name in SOLVE_KEYWORDS} == set(rows)
    for name, row in rows.items():
        required = parameters[name].default is inspect.Parameter.empty
        assert required if name == "time_step" else parameters[name].default == row.default


@pytest.mark.parametrize("solve", SOLVES)
def test_docstring_has_the_texts_of_the_table(solve) -> None:
    docstring = flattened(getattr(ms, solve).__doc__)
    assert "{keywords}" not in docstring
    for row in keywords_of(solve):
        text = row.motion_text if solve == "simulate" and row.motion_text else row.text
        own = solve == row.solves[0] or text == row.motion_text
        assert flattened(text) in docstring if own else f"as in ms.{row.solves[0]}." in docstring


def test_no_other_function_has_a_keyword_of_the_table_but_under_its_name() -> None:
    for solve in ("vibration_modes", "minimize"):
        assert not set(inspect.signature(getattr(ms, solve)).parameters) & set(SOLVE_KEYWORDS)


def test_values_of_the_shell_are_those_that_a_solve_can_replace() -> None:
    # Rest positions and the susceptibility are given by `values=` only.
    replaceable = [
        name
        for name in ms.Shell._replaceable
        if name not in ("remanent_magnetization", "rest_positions", "susceptibility", *ms.Shell._in_time)
    ]
    assert sorted(names_of("shell")) == sorted(replaceable)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        (
            "damping",
            np.zeros(2),
            r"damping \[N s/m\] must be a number or have shape \(n_v,\) = \(4,\), got \(2,\)",
        ),
        ("damping", -1.0, r"damping \[N s/m\] must not be negative, got -1"),
        ("damping", [0, 0, -2.0, 0], r"damping \[N s/m\] must not be negative, but the smallest is -2"),
        (
            "velocities",
            np.zeros(4),
            r"velocities \[m/s\] must have shape \(n_v, 3\) = \(4, 3\) or \(3,\), got \(4,\)",
        ),
        ("time_step", 0.0, r"time_step \[s\] must be positive, got 0"),
        ("load_factor", [1.0], r"load_factor \[1\] must be a number, got shape \(1,\)"),
        ("vertex_loads", np.zeros(3), r"vertex_loads \[N\] must have shape \(4, 3\), got \(3,\)"),
    ],
)
def test_wrong_value_is_refused_with_name_unit_and_shapes(name, value, words) -> None:
    with pytest.raises(ValueError, match=words):
        keyword_value(SOLVE_KEYWORDS[name], value, {"n_v": 4})
