"""The state of one minimization: where its optimizer stands, the history, the best design."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import asdict

from ._answer import Answer
from ._arrays import number
from ._checkpoint import decoded, encoded
from ._tensors import is_tensor, require_torch
from .errors import DesignRejected, EquilibriumJumped
from .minimum import STANDSTILL, Minimum, Record


class Run:
    """One minimization, an iteration at a time. Arguments as in `ms.minimize`; cross: whether jumps are crossed."""

    def __init__(
        self,
        objective: Callable,
        parameters: Sequence,
        optimizer,
        feasibility: float,
        stateful: Sequence,
        cross: bool,
    ):
        if not callable(objective):
            raise ValueError(f"objective must be a function of the parameters, got {objective!r:.60}")
        self.parameters = _checked_parameters(parameters)
        self.optimizer = _driven(optimizer(self.parameters) if callable(optimizer) else optimizer)
        if {id(p) for p in self.parameters} != {id(p) for p in self.optimizer.parameters}:
            raise ValueError("the optimizer must have been made with the same tensors as `parameters`")
        self.stateful = _checked_stateful(stateful)
        self.objective, self.feasibility = objective, number("feasibility", feasibility)
        if not self.feasibility >= 0:
            raise ValueError(f"feasibility must not be negative, got {feasibility}")
        self.history: list[Record] = []
        self.best: dict | None = None
        offering = {id(each): each for each in (objective, *self.stateful) if hasattr(each, "accept_jumps")}
        self._crossing = list(offering.values()) if cross else []
        self._evaluations = 0
        self.rejected = 0  # trial designs of the iteration under way
        self._answers: list[tuple[list, dict]] = []  # the designs of one step, and the terms there
        self._terms: dict[str, float] = {}
        self._started = time.perf_counter()

    @property
    def iteration(self) -> int:
        return self.history[-1].iteration if self.history else 0

    def closure(self):
        self._evaluations += 1
        try:
            answer = Answer.of(self.objective(*self.parameters))
        except DesignRejected:
            self.rejected += 1
            raise
        self._answers.append((self._values(), answer.terms))
        return answer.objective, answer.constraints

    def begin(self) -> None:
        self._record(0, self.optimizer.evaluate(self.closure), jumped=False)

    def advance(self) -> bool:
        """One step; whether it moved anything. Raises the last rejection if no step was short enough."""
        before = self._values()
        self._answers, self.rejected = [], 0
        try:
            self.optimizer.step(self.closure)
            jumped = False
        except EquilibriumJumped:
            if not self._crossing:
                raise
            with ExitStack() as accepted:
                for each in self._crossing:
                    accepted.enter_context(each.accept_jumps())
                self.optimizer.leap(self.closure)
            jumped = True
        moved = any(not a.equal(b) for a, b in zip(before, self._values(), strict=True))
        self._record(self.iteration + 1, self.optimizer.evaluate(self.closure), jumped)
        return moved

    @property
    def standstill(self) -> str:
        """What it means that a step moved nothing."""
        return getattr(self.optimizer, "standstill", STANDSTILL)

    def minimum(self, reason: str) -> Minimum | None:
        """The best design, which the parameters are set to. None before there is any."""
        if self.best is None:
            return None
        self._set(self.best["parameters"])
        best = [value.clone() for value in self.best["parameters"]]
        return Minimum(best, self.best["objective"], self.best["violation"], self.history, reason)

    def snapshot(self) -> dict:
        return {
            "method": _method(self.optimizer),
            "parameters": self._values(),
            "optimizer": self.optimizer.state_dict(),
            "history": [asdict(record) for record in self.history],
            "best": self.best,
            "terms": self._terms,
            "stateful": [encoded(each.state_dict(), f"state of {_name(each)}") for each in self.stateful],
        }

    def restore(self, snapshot: dict) -> None:
        shapes = [tuple(value.shape) for value in snapshot["parameters"]]
        if shapes != [tuple(p.shape) for p in self.parameters]:
            raise ValueError(f"the checkpoint holds parameters of shapes {shapes}, not those of this problem")
        if snapshot["method"] != _method(self.optimizer):
            raise ValueError(
                f"the checkpoint is of {snapshot['method']}, and cannot be resumed with {_method(self.optimizer)}"
            )
        if len(snapshot["stateful"]) != len(self.stateful):
            raise ValueError(
                f"the checkpoint holds the state of {len(snapshot['stateful'])} objects, "
                f"but `stateful` has {len(self.stateful)}"
            )
        self._set(snapshot["parameters"])
        self.optimizer.load_state_dict(snapshot["optimizer"])
        for each, state in zip(self.stateful, snapshot["stateful"], strict=True):
            each.load_state_dict(decoded(state))
        self.history = [Record(**record) for record in snapshot["history"]]
        self.best, self._terms = snapshot["best"], snapshot["terms"]
        self._evaluations = self.history[-1].evaluations
        self._started -= self.history[-1].seconds

    def _record(self, iteration: int, sample, jumped: bool) -> None:
        values = self._values()
        for design, terms in self._answers:
            if all(a.equal(b) for a, b in zip(design, values, strict=True)):
                self._terms = terms
        record = Record(
            iteration,
            sample.objective,
            self._terms,
            sample.violation,
            math.sqrt(float(sample.gradient @ sample.gradient)),
            time.perf_counter() - self._started,
            self._evaluations,
            self.rejected,
            jumped,
        )
        self.history.append(record)
        if self.best is None or self._order(record.objective, record.violation) < self._order(
            self.best["objective"], self.best["violation"]
        ):
            self.best = {
                "parameters": values,
                "objective": record.objective,
                "violation": record.violation,
            }

    def _order(self, objective: float, violation: float) -> tuple[float, float]:
        """Feasible designs by their objective, before all others by how far they are from it."""
        return (0.0, objective) if violation <= self.feasibility else (violation, objective)

    def _values(self) -> list:
        return [parameter.detach().clone() for parameter in self.parameters]

    def _set(self, values: list) -> None:
        with require_torch("minimize").no_grad():
            for parameter, value in zip(self.parameters, values, strict=True):
                parameter.copy_(value)


def _driven(optimizer):
    """The optimizer as one that can be asked what is known where it stands."""
    from .optim.any_torch import AnyTorch
    from .optim.base import BoxOptimizer

    if isinstance(optimizer, BoxOptimizer):
        return optimizer
    if isinstance(optimizer, require_torch("minimize").optim.Optimizer):
        return AnyTorch(optimizer)
    raise ValueError(
        "optimizer must be one of ms.optim or torch.optim, or a function that makes one from the parameters, "
        f"got {optimizer!r:.60}"
    )


def _checked_parameters(parameters) -> list:
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


def _checked_stateful(stateful) -> list:
    for each in stateful:
        for method in ("state_dict", "load_state_dict"):
            if not callable(getattr(each, method, None)):
                raise ValueError(f"every object in `stateful` needs {method}(), and {_name(each)} has none")
    return list(stateful)


def _method(optimizer) -> str:
    return _name(getattr(optimizer, "optimizer", optimizer))  # what AnyTorch drives


def _name(each) -> str:
    return type(each).__name__
