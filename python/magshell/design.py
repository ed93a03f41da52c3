"""The loop that improves a design: history, early stop, checkpoints, and the best design whatever happens."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path

from ._checkpoint import load, save
from ._progress import progress_bar
from ._tensors import is_tensor, require_torch
from .errors import Interrupted, ObjectiveFailed


@dataclass(frozen=True)
class Record:
    """One iteration: the objective, its named terms, the largest positive constraint, |gradient| of the
    objective,
    seconds since the start, and how often the objective was asked for."""

    iteration: int
    objective: float
    terms: dict[str, float]
    violation: float
    gradient_norm: float
    seconds: float
    evaluations: int


@dataclass
class Minimum:
    """What `minimize` found. parameters: the best design, as tensors in the order given; history: a Record an
    iteration, from the start."""

    parameters: list
    objective: float
    violation: float
    history: list[Record] = field(default_factory=list)
    reason: str = ""

    @property
    def iterations(self) -> int:
        return self.history[-1].iteration if self.history else 0

    def __repr__(self) -> str:
        broken = f", constraints broken by {self.violation:.2g}" if self.violation > 0 else ""
        reached = f"Minimum: objective {self.objective:.6g}{broken}"
        return f"{reached} after {self.iterations} iterations ({self.reason})"


def minimize(
    objective: Callable,
    parameters: Sequence,
    optimizer,
    *,
    max_iterations: int = 100,
    tolerance: float = 0.0,
    patience: int = 3,
    feasibility: float = 1e-6,
    callback: Callable[[Record], bool | None] | None = None,
    progress: bool = True,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 1,
    resume: bool = False,
) -> Minimum:
    """Minimizes objective(*parameters) and leaves the parameters at the best design.

    objective: returns a scalar tensor, or a dict of named terms whose sum it is, or a tuple of one of these
    with a dict of
    terms to record, with a tensor of constraints (m,) <= 0, or with both.
    parameters: tensors with requires_grad, the ones the optimizer was made with.
    optimizer: one of `ms.optim`, or a function that makes one from the list of parameters.
    tolerance: stops once the objective changed by no more than this share of itself, `patience` times in a
    row.
    feasibility: how far a constraint may be broken by a design that counts as feasible when the best is
    chosen.
    callback: called with each Record; returning True stops.
    progress: show a bar. checkpoint: a file that is replaced, whole or not at all, every `checkpoint_every`
    iterations;
    resume: continue from it if it exists, with the same bits as without the stop.

    Ctrl-C raises `ms.Interrupted`, an error in the objective or the callback `ms.ObjectiveFailed`, once a
    design is known; both hold the best one,
    a Minimum, in `last_good`. Before that the error itself comes through.

    >>> x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    # Doctest: +SKIP
    >>> ms.minimize(lambda x: ((x - 1) ** 2).sum(), [x], ms.optim.LBFGS([x], upper=0.5)).objective
    0.75
    """
    require_torch("minimize")
    if max_iterations < 0 or checkpoint_every < 1 or patience < 1:
        raise ValueError(
            "max_iterations must not be negative; checkpoint_every and patience must be positive"
        )
    if not tolerance >= 0:
        raise ValueError(f"tolerance must not be negative, got {tolerance}")
    if resume and checkpoint is None:
        raise ValueError("resume needs the checkpoint to continue from")
    run = _Run(objective, parameters, optimizer, feasibility)
    if resume and Path(checkpoint).exists():
        run.restore(load(checkpoint))
    bar = progress_bar("minimize", max_iterations, shown=progress, initial=run.iteration)
    try:
        with bar:
            return _loop(
                run, max_iterations, tolerance, patience, callback, bar, checkpoint, checkpoint_every
            )
    except KeyboardInterrupt as error:
        raise Interrupted(
            f"interrupted after {run.iteration} iterations", run.minimum("interrupted")
        ) from error
    except Exception as error:
        if run.best is None:
            raise
        raise ObjectiveFailed(
            f"iteration {run.iteration + 1} failed: {error}\n"
            "The best design so far is in `error.last_good`, and in the parameters.",
            run.minimum("failed"),
        ) from error


def _loop(run, max_iterations, tolerance, patience, callback, bar, checkpoint, checkpoint_every) -> Minimum:
    stopped = False
    if not run.history:
        run.begin()
        stopped = callback is not None and callback(run.history[-1]) is True
    while not stopped and run.iteration < max_iterations:
        moved = run.advance()
        last = run.history[-1]
        bar.update()
        bar.set_postfix_str(f"objective {last.objective:.6g}")
        if checkpoint is not None and (
            run.iteration % checkpoint_every == 0 or run.iteration == max_iterations
        ):
            save(checkpoint, run.snapshot())
        if callback is not None and callback(last) is True:
            stopped = True
        elif not moved:
            return run.minimum("no lower design along the gradient, to rounding")
        elif tolerance > 0 and _settled(run.history, tolerance, patience):
            return run.minimum("the objective has settled")
    return run.minimum("stopped by the callback" if stopped else "max_iterations reached")


def _settled(history: list[Record], tolerance: float, patience: int) -> bool:
    values = [record.objective for record in history[-patience - 1 :]]
    changes = [abs(b - a) <= tolerance * abs(b) for a, b in pairwise(values)]
    return len(changes) == patience and all(changes)


class _Run:
    """The state of one minimization: optimizer, history, best design."""

    def __init__(self, objective: Callable, parameters: Sequence, optimizer, feasibility: float):
        from .optim.base import BoxOptimizer

        if not callable(objective):
            raise ValueError(f"objective must be a function of the parameters, got {objective!r:.60}")
        self.parameters = [parameters] if is_tensor(parameters) else list(parameters)
        self.optimizer = optimizer(self.parameters) if callable(optimizer) else optimizer
        if not isinstance(self.optimizer, BoxOptimizer):
            raise ValueError(f"optimizer must be one of ms.optim, got {type(self.optimizer).__name__}")
        if {id(p) for p in self.parameters} != {id(p) for p in self.optimizer.parameters}:
            raise ValueError("the optimizer must have been made with the same tensors as `parameters`")
        self.objective, self.feasibility = objective, feasibility
        self.history: list[Record] = []
        self.best: dict | None = None
        self._evaluations, self._terms = 0, {}
        self._started = time.perf_counter()

    @property
    def iteration(self) -> int:
        return self.history[-1].iteration if self.history else 0

    def closure(self):
        objective, self._terms, constraints = _parts(self.objective(*self.parameters))
        self._evaluations += 1
        return objective, constraints

    def begin(self) -> None:
        self._record(0, self.optimizer.evaluate(self.closure))

    def advance(self) -> bool:
        """One step; whether it moved anything."""
        before, iteration = self._values(), self.iteration + 1
        terms = self._terms
        self.optimizer.step(self.closure)
        moved = any(not a.equal(b) for a, b in zip(before, self._values(), strict=True))
        if not moved:
            self._terms = terms
        self._record(iteration, self.optimizer.evaluate(self.closure))
        return moved

    def minimum(self, reason: str) -> Minimum | None:
        """The best design, which the parameters are set to. None before there is any."""
        if self.best is None:
            return None
        torch = require_torch("minimize")
        with torch.no_grad():
            for parameter, value in zip(self.parameters, self.best["parameters"], strict=True):
                parameter.copy_(value)
        best = [value.clone() for value in self.best["parameters"]]
        return Minimum(best, self.best["objective"], self.best["violation"], self.history, reason)

    def snapshot(self) -> dict:
        return {
            "parameters": self._values(),
            "optimizer": self.optimizer.state_dict(),
            "history": [asdict(record) for record in self.history],
            "best": self.best,
            "terms": self._terms,
        }

    def restore(self, snapshot: dict) -> None:
        torch = require_torch("minimize")
        shapes = [tuple(value.shape) for value in snapshot["parameters"]]
        if shapes != [tuple(p.shape) for p in self.parameters]:
            raise ValueError(f"the checkpoint holds parameters of shapes {shapes}, not those of this problem")
        with torch.no_grad():
            for parameter, value in zip(self.parameters, snapshot["parameters"], strict=True):
                parameter.copy_(value)
        self.optimizer.load_state_dict(snapshot["optimizer"])
        self.history = [Record(**record) for record in snapshot["history"]]
        self.best, self._terms = snapshot["best"], snapshot["terms"]
        self._evaluations = self.history[-1].evaluations
        self._started -= self.history[-1].seconds

    def _record(self, iteration: int, sample) -> None:
        norm = math.sqrt(float(sample.gradient @ sample.gradient))
        seconds = time.perf_counter() - self._started
        record = Record(
            iteration, sample.objective, self._terms, sample.violation, norm, seconds, self._evaluations
        )
        self.history.append(record)
        if self.best is None or self._order(record.objective, record.violation) < self._order(
            self.best["objective"], self.best["violation"]
        ):
            self.best = {
                "parameters": self._values(),
                "objective": record.objective,
                "violation": record.violation,
            }

    def _order(self, objective: float, violation: float) -> tuple[float, float]:
        """Feasible designs by their objective, before all others by how far they are from it."""
        return (0.0, objective) if violation <= self.feasibility else (violation, objective)

    def _values(self) -> list:
        return [parameter.detach().clone() for parameter in self.parameters]


def _parts(result) -> tuple:
    """(objective, terms as floats, constraints or None) of what an objective returned."""
    head, *rest = result if isinstance(result, tuple) else (result,)
    terms, constraints = {}, None
    if isinstance(head, dict):
        if not head:
            raise ValueError("the objective returned no terms")
        terms, head = head, sum(head.values())
    for part in rest:
        if isinstance(part, dict):
            terms = {**terms, **part}
        elif is_tensor(part):
            constraints = part
        else:
            raise TypeError(
                f"beside its value an objective returns a dict of terms or a tensor, got {type(part)}"
            )
    return head, {name: float(value) for name, value in terms.items()}, constraints
