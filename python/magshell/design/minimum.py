"""What `ms.minimize` reports: a record an iteration, and the best design."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .._machine.frozen import immutable
from .rejections import effort_in_words, in_words, total


@immutable
@dataclass(frozen=True)
class Record:
    """One iteration.

    objective, its named terms, violation: the largest positive constraint. gradient_norm: |gradient| of the objective.
    seconds: since the start. evaluations: how often the objective was asked for, since the start. rejected: trial
    designs of this iteration that could not be evaluated; rejections: why, {reason: how many}. jumped: whether the
    equilibrium jumped in its step.
    """

    iteration: int
    objective: float
    terms: dict[str, float]
    violation: float
    gradient_norm: float
    seconds: float
    evaluations: int
    rejected: int = 0
    jumped: bool = False
    rejections: dict[str, int] = field(default_factory=dict)


@immutable
@dataclass(frozen=True)
class Minimum:
    """What `minimize` found. parameters: the best design, as tensors in the order given; history: a Record an
    iteration, from the start; reason: why it ended. rejections: why trial designs could not be evaluated, {reason: how
    many}, in all. conflict: what seems to keep the objective from falling, where it is one and the same jump of the
    equilibrium in every one of the last iterations; else empty."""

    parameters: Sequence[Any]
    objective: float
    violation: float
    history: Sequence[Record] = ()
    reason: str = ""
    rejections: dict[str, int] = field(default_factory=dict)
    conflict: str = ""

    @property
    def iterations(self) -> int:
        """How many were taken."""
        return self.history[-1].iteration if self.history else 0

    def __repr__(self) -> str:
        broken = f", constraints broken by {self.violation:.2g}" if self.violation > 0 else ""
        reached = f"Minimum: objective {self.objective:.6g}{broken}"
        evaluations = f", {self.history[-1].evaluations} evaluations" if self.history else ""
        rejected = in_words(self.rejections)
        first = f"{reached} after {self.iterations} iterations{evaluations} ({self.reason})"
        return "\n  ".join(filter(None, (first, rejected, self.conflict)))


def effort(minima: Iterable[Minimum]) -> str:
    """What several searches took together; empty where there was none."""
    found = list(minima)
    if not found:
        return ""
    evaluations = sum(each.history[-1].evaluations for each in found if each.history)
    return ", ".join(effort_in_words(evaluations, total(each.rejections for each in found)))
