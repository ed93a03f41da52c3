"""Table of hard cases: functions that solve something difficult and return an expected and a found answer."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

TIME_LIMIT = 60.0  # s, of a case


@dataclass(frozen=True)
class Answer:
    """The answer that a case must reach, the one it reached, and whether that is right."""

    expected: str
    got: str
    right: bool


@dataclass(frozen=True)
class Case:
    """A row of the table. hard: what is difficult about it. run: solves it."""

    family: str
    name: str
    hard: str
    run: Callable[[], Answer]

    @property
    def id(self) -> str:
        return f"{self.family}: {self.name}"


@dataclass(frozen=True)
class Verdict:
    """The end of a case. An exception that the case did not ask for is a failure, with its text."""

    case: Case
    answer: Answer
    seconds: float

    @property
    def passed(self) -> bool:
        return self.answer.right and self.seconds < TIME_LIMIT


CASES: list[Case] = []


def case(hard: str, over: Iterable = ()):
    """Enter a function into the table: once, or once for each value of `over`, its only argument.

    `hard` may contain a placeholder for the value, as in "thickness over length {:g}". The family is the file's name, the
    row's name the function's.
    """

    def enter(function):
        family = function.__module__.removeprefix("cases_").replace("_", " ")
        name = function.__name__.replace("_", " ")
        values = tuple(over)
        for value in values:
            row = f"{name}, {value:g}" if isinstance(value, float) else f"{name}, {value}"
            CASES.append(Case(family, row, hard.format(value), partial(function, value)))
        if not values:
            CASES.append(Case(family, name, hard, function))
        return function

    return enter


def all_cases() -> list[Case]:
    """Return the cases of every file beside this one that is named cases_*.py."""
    for path in sorted(Path(__file__).parent.glob("cases_*.py")):
        importlib.import_module(path.stem)
    return sorted(CASES, key=lambda each: each.family)  # whatever was imported first


def judge(case: Case) -> Verdict:
    """Run a case and return its verdict."""
    began = time.perf_counter()
    try:
        answer = case.run()
    except Exception as error:
        answer = Answer("an answer", f"{type(error).__name__}: {error}", False)
    return Verdict(case, answer, time.perf_counter() - began)
