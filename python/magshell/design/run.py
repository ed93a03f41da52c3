"""State of one minimization: its optimizer, the history, the best design."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from .._input.arrays import number
from .._input.tensors import is_tensor, require_torch
from .._runtime.log import log
from .._runtime.tried_designs import trying_designs
from ..errors import DesignRejected, EquilibriumJumped
from .configuration import as_stored, decoded, encoded
from .jump_policies import checked_stateful, jumps_accepted, offering
from .minimum import MinimizeResult, Record, conflict, effort_in_words, reason_of, total
from .objective_value import Answer
from .resume import check_objective, check_same

if TYPE_CHECKING:
    from .._input.kinds import Optimizing
    from .optim.base import BoxOptimizer
    from .optim.torch_adapter import TorchAdapter

PARTS = (
    "method",
    "parameters",
    "optimizer",
    "history",
    "best",
    "terms",
    "stateful",
    "configuration",
)  # keys of a snapshot


@dataclass(frozen=True)
class _Seen:
    """A design that was evaluated, its terms, and the states from which it was evaluated.

    states is None if no checkpoint needs them.
    """

    design: list[Any]
    terms: dict[str, float]
    states: list[Any] | None = None


class Run:
    """One minimization, an iteration at a time.

    Arguments as in `ms.minimize`. cross: whether jumps are crossed; checkpointed: whether snapshots will be taken.
    """

    feasibility: float
    objective: Callable[..., Any]

    def __init__(
        self,
        objective: Callable[..., Any],
        parameters: Sequence[Any],
        optimizer: Optimizing,
        feasibility: float,
        stateful: Sequence[Any],
        cross: bool,
        checkpointed: bool,
    ):
        if not callable(objective):
            raise ValueError(f"objective must be a function of the parameters, got {objective!r:.60}")
        self.parameters: list[Any] = _checked_parameters(parameters)
        self.optimizer: BoxOptimizer | TorchAdapter = _adapted(
            optimizer(self.parameters) if callable(optimizer) else optimizer
        )
        if {id(p) for p in self.parameters} != {id(p) for p in self.optimizer.parameters}:
            raise ValueError("the optimizer must have been made with the same tensors as `parameters`")
        self.stateful: list[Any] = checked_stateful(stateful)
        self.objective, self.feasibility = objective, number("feasibility", feasibility)
        if not self.feasibility >= 0:
            raise ValueError(f"feasibility must not be negative, got {feasibility}")
        self.history: list[Record] = []
        self.best: dict[str, Any] | None = None
        self._offering, self._cross, self._checkpointed = (
            offering(objective, self.stateful),
            cross,
            checkpointed,
        )
        self.configuration: dict[str, Any] = as_stored(
            {"feasibility": feasibility, **self.optimizer.configuration()}
        )
        self._evaluations = 0
        self.rejections: Counter[str] = Counter()  # of the current iteration
        self.watch: Callable[[], None] = lambda: None  # called after every evaluation
        self._answers: list[_Seen] = []  # evaluated in the current step
        self._at = _Seen([], {})  # the design of the last record
        self._recorded = False  # whether the current iteration is in the history
        self._stuck = False  # whether every step, however short, met a jump
        self._started = time.perf_counter()

    @property
    def method(self) -> str:
        """The class name of the optimizer."""
        return _name(getattr(self.optimizer, "optimizer", self.optimizer))  # TorchAdapter wraps an optimizer

    @property
    def rejected(self) -> int:
        """The number of trial designs that were rejected in the current iteration."""
        return sum(self.rejections.values())

    @property
    def iteration(self) -> int:
        """The number of the last recorded iteration."""
        return self.history[-1].iteration if self.history else 0

    def closure(self) -> Any:
        """Evaluate the objective at the current parameters for the optimizer: returns it, and the constraints."""
        self._evaluations += 1
        before = self.states() if self._checkpointed else None
        try:
            answer = self.answer()
        except DesignRejected as error:
            self.rejections[reason_of(error)] += 1
            log.debug("minimize: design %d rejected: %s", self._evaluations, error)
            raise
        finally:
            self.watch()
        self._answers.append(_Seen(self.values(), answer.terms, before))
        return answer.objective, answer.constraints

    def answer(self) -> Answer:
        """Evaluate the objective at the current parameters: what it returns, in parts."""
        answered = self.objective(*self.parameters)
        return Answer.of_residuals(answered) if self.optimizer.takes_residuals else Answer.of(answered)

    def begin(self) -> None:
        """Evaluate the start and record it as iteration 0."""
        self._record(0, self.optimizer.evaluate(self.closure), jumped=False)

    def advance(self) -> bool:
        """Take one step and return whether a parameter changed. Raises the last rejection if no step was short
        enough."""
        before = self.values()
        self._answers, self.rejections, self._recorded = [], Counter(), False
        try:
            with trying_designs():
                self.optimizer.step(self.closure)
            jumped = False
        except EquilibriumJumped:
            if not (self._cross and self._offering):
                self._stuck = True
                raise
            with self.accepting_jumps():
                self.optimizer.full_step(self.closure)
            jumped = True
        moved = any(not a.equal(b) for a, b in zip(before, self.values(), strict=True))
        self._record(self.iteration + 1, self.optimizer.evaluate(self.closure), jumped)
        return moved

    @property
    def stagnation(self) -> str:
        """The reason to give if a step changed nothing."""
        from .optim.sample import STAGNATION  # imports torch

        return getattr(self.optimizer, "stagnation", STAGNATION)

    def minimum(self, reason: str) -> MinimizeResult | None:
        """Set the parameters to the best design and return the result; None before a design was evaluated."""
        if self.best is None:
            return None
        self.set(self.best["parameters"])
        best = [value.clone() for value in self.best["parameters"]]
        obstacles = self._all_rejections, conflict(self.history, self._lost, self._stuck)
        return MinimizeResult(
            best, self.best["objective"], self.best["violation"], self.history, reason, *obstacles
        )

    def snapshot(self) -> dict[Any, Any]:
        """Return the state as a dict for a checkpoint."""
        return {
            "method": self.method,
            "parameters": self.values(),
            "optimizer": self.optimizer.state_dict(),
            "history": [_plain(record) for record in self.history],
            "best": self.best,
            "terms": self._at.terms,
            "stateful": self.states(),
            "configuration": self.configuration,
        }

    def restore(self, snapshot: dict[Any, Any]) -> None:
        """Continue from a snapshot. Raises ValueError if it is of another problem, and then changes nothing."""
        check_same(self, snapshot)
        check_objective(self, snapshot)
        self.set(snapshot["parameters"])
        self.optimizer.load_state_dict(snapshot["optimizer"])
        self.load_states(snapshot["stateful"])
        self.history = [Record(**record) for record in snapshot["history"]]
        self.best, self._at = snapshot["best"], _Seen(self.values(), snapshot["terms"])
        self._evaluations = self.history[-1].evaluations
        self._started -= self.history[-1].seconds

    def summary(self) -> str:
        """Format the objective, and how many designs were evaluated and rejected so far."""
        parts = [f"objective {self.history[-1].objective:.6g}"] if self.history else []
        return ", ".join([*parts, *effort_in_words(self._evaluations, self._all_rejections)])

    @property
    def _lost(self) -> dict[str, int]:
        """The rejections of an iteration that is not, or never will be, in the history."""
        return {} if self._recorded else dict(self.rejections)

    @property
    def _all_rejections(self) -> dict[str, int]:
        return dict(total([*(record.rejections for record in self.history), self._lost]))

    def _record(self, iteration: int, sample, jumped: bool) -> None:
        """Append the current design to the history, and keep it if it is the best."""
        values = self.values()
        for seen in self._answers:
            if all(a.equal(b) for a, b in zip(seen.design, values, strict=True)):
                self._at = seen
        record = Record(
            iteration,
            sample.objective,
            self._at.terms,
            sample.violation,
            math.sqrt(float(sample.gradient @ sample.gradient)),
            time.perf_counter() - self._started,
            self._evaluations,
            self.rejected,
            jumped,
            dict(self.rejections),
        )
        self.history.append(record)
        self._recorded = True
        if self.best is None or self._order(record.objective, record.violation) < self._order(
            self.best["objective"], self.best["violation"]
        ):
            self.best = {
                "parameters": values,
                "objective": record.objective,
                "violation": record.violation,
                "stateful": self._at.states,
                "jumped": jumped,
            }

    def _order(self, objective: float, violation: float) -> tuple[float, float]:
        """Return a sort key: feasible designs first, by their objective; then the others, by their violation."""
        return (0.0, objective) if violation <= self.feasibility else (violation, objective)

    def values(self) -> list[Any]:
        """Return copies of the parameters."""
        return [parameter.detach().clone() for parameter in self.parameters]

    def states(self) -> list[Any]:
        """Return the states of the stateful objects, as a checkpoint stores them."""
        return [encoded(each.state_dict(), f"state of {_name(each)}") for each in self.stateful]

    def load_states(self, states: list[Any]) -> None:
        """Set the states of the stateful objects."""
        for each, state in zip(self.stateful, states, strict=True):
            each.load_state_dict(decoded(state))

    @contextmanager
    def accepting_jumps(self, accepted: bool = True) -> Iterator[None]:
        """Let the equilibrium jump inside the block, if an object has accept_jumps()."""
        with jumps_accepted(self._offering if accepted else []):
            yield

    def set(self, values: list[Any]) -> None:
        """Set the parameters to these values."""
        with require_torch("minimize").no_grad():
            for parameter, value in zip(self.parameters, values, strict=True):
                parameter.copy_(value)


def _adapted(optimizer):
    """Return the optimizer with the interface of BoxOptimizer; one of torch.optim is wrapped."""
    from .optim.base import BoxOptimizer
    from .optim.torch_adapter import TorchAdapter

    if isinstance(optimizer, BoxOptimizer):
        return optimizer
    if isinstance(optimizer, require_torch("minimize").optim.Optimizer):
        return TorchAdapter(optimizer)
    raise ValueError(
        "optimizer must be one of ms.optim or torch.optim, or a function that makes one from the parameters, "
        f"got {optimizer!r:.60}"
    )


def _checked_parameters(parameters) -> list[Any]:
    """Return the parameters as a list. Raises ValueError unless each is a leaf tensor that requires a gradient."""
    parameters = [parameters] if is_tensor(parameters) else list(parameters)
    if not parameters:
        raise ValueError("there are no parameters to optimize")
    for position, parameter in enumerate(parameters):
        if not is_tensor(parameter):
            raise ValueError(f"parameter {position} must be a torch tensor, got {parameter!r:.60}")
        if not (parameter.requires_grad and parameter.is_leaf):
            raise ValueError(
                f"parameter {position} of shape {tuple(parameter.shape)} must be a tensor of its own that requires a "
                "gradient: x = x.detach().clone().requires_grad_()"
            )
    return parameters


def _name(each) -> str:
    return type(each).__name__


def _plain(record: Record) -> dict[str, Any]:
    """Convert a record to plain dicts, since torch.load accepts no others."""
    return {**asdict(record), "terms": dict(record.terms), "rejections": dict(record.rejections)}
