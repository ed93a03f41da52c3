"""Results of a minimization, and descriptions of the designs that it could not evaluate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .._runtime.frozen import immutable
from ..errors import DesignRejected, EquilibriumJumped, NotConverged

_JUMP = "jump"
_IN_A_ROW = 3  # iterations in a row that must meet the same jump before it is reported
_SLOW = 0.01  # [-] relative decrease of the objective per iteration below which progress counts as slow


def reason_of(error: DesignRejected) -> str:
    """Return a short reason, the same for all designs that are rejected for the same cause."""
    if not isinstance(error, EquilibriumJumped | NotConverged):
        return f"{str(error).strip().splitlines()[0]:.60}" if str(error).strip() else type(error).__name__
    case = "" if error.load_case is None else f" in load case {error.load_case}"
    return f"{_JUMP}{case}" if isinstance(error, EquilibriumJumped) else f"no equilibrium found{case}"


def total(rejections: Iterable[Mapping[str, int]]) -> Counter[str]:
    """Count the rejections of several iterations: {reason: how often}."""
    counted: Counter[str] = Counter()
    for each in rejections:
        counted.update(each)
    return counted


def in_words(rejections: Mapping[str, int]) -> str:
    """Format rejections, such as "7 rejected (5 jump in load case 1, 2 no equilibrium found)"; "" if there are none."""
    if not rejections:
        return ""
    listed = Counter(rejections).most_common()
    reasons = listed[0][0] if len(listed) == 1 else ", ".join(f"{count} {reason}" for reason, count in listed)
    return f"{sum(rejections.values())} rejected ({reasons})"


def effort_in_words(evaluations: int, rejections: Mapping[str, int]) -> list[str]:
    """Format the effort of a search so far, for its bar and the log: ["31 evaluations", "2 rejected (jump)"]."""
    return [f"{evaluations} evaluations", *filter(None, [in_words(rejections)])]


def conflict(history: Sequence[Any], lost: Mapping[str, int], stuck: bool) -> str:
    """Describe a jump of the equilibrium that seems to keep the objective from falling; "" if there is none.

    That is the case if every one of the last iterations met the same jump and gained little, or if the run ended
    at one. Lower designs then probably lie beyond the jump, but this is not certain.

    history: Records. lost: rejections of an iteration that did not end; stuck: whether it was rejected at every
    step length.
    """
    iterations = [record.rejections for record in history] + ([lost] if lost else [])
    jumps = [reason for reason in (iterations[-1] if iterations else ()) if reason.startswith(_JUMP)]
    for reason in jumps:
        met = next((k for k, each in enumerate(reversed(iterations)) if reason not in each), len(iterations))
        ended = met - bool(
            lost
        )  # how many of those are in the history; `before` is the objective ahead of them
        before, after = history[max(-ended - 1, -len(history))].objective, history[-1].objective
        fall = (before - after) / abs(before) if before else 0.0
        if stuck:
            seen = f"The last step was rejected at every length, for a {reason}"
        elif met >= _IN_A_ROW and fall < _SLOW * met:
            changed = f"fell by {100 * fall:.2g} %" if fall > 0 else "did not fall"
            seen = f"In each of the last {met} iterations designs were rejected for a {reason}, and the objective {changed}"
        else:
            continue
        others = "" if reason == _JUMP else ", and what is asked of that load case may conflict with the rest"
        return (
            f"{seen}: lower designs seem to lie beyond that jump{others}. Weigh the terms differently, start from a "
            "design on its other side, or have it crossed (`stateful`, `on_jump`)."
        )
    return ""


@immutable
@dataclass(frozen=True)
class Record:
    """One iteration of a minimization.

    objective: its value; terms: its named parts; violation: the largest positive constraint. gradient_norm:
    |gradient| of the objective. seconds: since the start. evaluations: calls of the objective since the start.
    rejected: trial designs of this iteration that could not be evaluated; rejections: why, {reason: how many}.
    jumped: whether the equilibrium jumped in its step.
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
class MinimizeResult:
    """The result of `minimize`.

    parameters: the best design, as tensors in the order given; history: one Record for each iteration, from the
    start; reason: why it ended. rejections: why trial designs could not be evaluated, {reason: how many}, in all.
    conflict: the jump that seems to keep the objective from falling, if every one of the last iterations met the
    same jump of the equilibrium; else "".
    """

    parameters: Sequence[Any]
    objective: float
    violation: float
    history: Sequence[Record] = ()
    reason: str = ""
    rejections: dict[str, int] = field(default_factory=dict)
    conflict: str = ""

    @property
    def iterations(self) -> int:
        """The number of iterations taken."""
        return self.history[-1].iteration if self.history else 0

    def __repr__(self) -> str:
        broken = f", constraints broken by {self.violation:.2g}" if self.violation > 0 else ""
        reached = f"MinimizeResult: objective {self.objective:.6g}{broken}"
        evaluations = f", {self.history[-1].evaluations} evaluations" if self.history else ""
        rejected = in_words(self.rejections)
        first = f"{reached} after {self.iterations} iterations{evaluations} ({self.reason})"
        return "\n  ".join(filter(None, (first, rejected, self.conflict)))


def effort(minima: Iterable[MinimizeResult]) -> str:
    """Format the evaluations and rejections of several searches together; "" if there was none."""
    found = list(minima)
    if not found:
        return ""
    evaluations = sum(each.history[-1].evaluations for each in found if each.history)
    return ", ".join(effort_in_words(evaluations, total(each.rejections for each in found)))
