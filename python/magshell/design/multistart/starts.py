"""Results of many starts: the finished ones, best first, and the failed ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from ..._runtime.frozen import immutable

_MOST_SHOWN = 5  # starts in a printed MultistartResult


@immutable
@dataclass(frozen=True, eq=False)
class FinishedStart:
    """A start that has finished.

    number: its position in the list of starts. result: the return value of run. objective, violation: those of the result;
    the violation is the amount by which constraints are broken, 0 if none is. seconds: its duration.
    """

    _as_given: ClassVar = ("start", "result")

    number: int
    start: Any = field(repr=False)
    objective: float
    violation: float
    result: Any
    seconds: float


@immutable
@dataclass(frozen=True, eq=False)
class FailedStart:
    """A start that has failed.

    error: the message; traceback: where it was raised, if known. last_good: the `last_good` of the error, such as
    the best MinimizeResult until then.
    """

    _as_given: ClassVar = ("start", "last_good")

    number: int
    start: Any = field(repr=False)
    error: str
    traceback: str = field(repr=False)
    last_good: Any
    seconds: float


@immutable
@dataclass(frozen=True, eq=False, repr=False)
class MultistartResult(Sequence[Any]):
    """The finished starts as a sequence, best first: feasible ones by objective, then the others by violation.

    finished: the sequence. failed: FailedStarts, by number. unfinished: numbers of the starts that have neither finished
    nor failed, because of an interruption or error. seconds: duration of the call.
    resumed: numbers of the starts whose results came from the checkpoint.
    """

    finished: tuple[FinishedStart, ...]
    failed: tuple[FailedStart, ...]
    unfinished: tuple[int, ...]
    seconds: float
    resumed: tuple[int, ...] = ()

    def __getitem__(self, index: Any) -> Any:
        return self.finished[index]

    def __len__(self) -> int:
        return len(self.finished)

    @property
    def best(self) -> FinishedStart:
        """The start with the best result. Raises ValueError if none has finished."""
        if not self.finished:
            raise ValueError(
                f"no start has finished: {len(self.failed)} failed, {len(self.unfinished)} were left"
            )
        return self.finished[0]

    @property
    def objectives(self) -> np.ndarray:
        """The objectives of the finished starts, (n,), best first."""
        return np.array([found.objective for found in self.finished])

    def __repr__(self) -> str:
        total = len(self.finished) + len(self.failed) + len(self.unfinished)
        head = f"MultistartResult: {len(self.finished)} of {total} starts finished in {self.seconds:.3g} s"
        head += f", {len(self.resumed)} of them earlier (from the checkpoint)" if self.resumed else ""
        head += f", {len(self.failed)} failed" if self.failed else ""
        lines = [f"  start {found.number}: {_in_words(found)}" for found in self.finished[:_MOST_SHOWN]]
        if len(self.finished) > _MOST_SHOWN:
            rest = self.objectives[_MOST_SHOWN:]
            lines.append(
                f"  ... and {len(rest)} more, with objectives from {rest.min():.6g} to {rest.max():.6g}"
            )
        lines += [f"  start {lost.number} failed: {lost.error:.200}" for lost in self.failed[:_MOST_SHOWN]]
        if len(self.failed) > _MOST_SHOWN:
            lines.append(f"  ... and {len(self.failed) - _MOST_SHOWN} more that failed")
        return "\n".join([head, *lines])


def _in_words(found: FinishedStart) -> str:
    broken = f", constraints broken by {found.violation:.2g}" if found.violation > 0 else ""
    return f"objective {found.objective:.6g}{broken}, {found.seconds:.3g} s"
