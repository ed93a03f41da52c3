"""Minimizes an objective: the loop over iterations, its end, checkpoints, and the best design in any case."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._input.arrays import count
from .._input.tensors import require_torch
from .._runtime.log import log
from .._runtime.progress import progress_bar
from ..errors import DesignRejected, EquilibriumJumped, Interrupted, ObjectiveFailed
from .configuration import load, save
from .minimum import MinimizeResult, Record
from .run import PARTS, Run

if TYPE_CHECKING:
    from .._input.kinds import Optimizing

_TIME_TO_READ = 0.2  # [s] shortest time between two texts of the progress bar


def minimize(
    objective: Callable[..., Any],
    parameters: Sequence[Any],
    optimizer: Optimizing,
    *,
    max_iterations: int = 100,
    tolerance: float = 0.0,
    patience: int = 3,
    feasibility: float = 1e-6,
    on_jump: str = "cross",
    stateful: Sequence[Any] = (),
    callback: Callable[[Record], bool | None] | None = None,
    progress: bool = True,
    checkpoint: str | Path | None = None,
    checkpoint_every: int = 1,
    resume: bool = False,
) -> MinimizeResult:
    """Minimize objective(*parameters) and leave the parameters at the best design.

    objective: function that returns a scalar tensor, or a dict of named terms to add up, or a tuple of one of these with
    a dict of terms to record, with a tensor of constraints (m,) <= 0, or with both. For `ms.optim.GaussNewton` it returns
    residuals (m,), or a dict of named ones; the objective is half of the sum of their squares.
    parameters: tensors with requires_grad, the ones the optimizer was made with.
    optimizer: one of `ms.optim` or of `torch.optim`, or a function that makes one from the list of parameters.
    Those of torch know no bounds and no constraints.
    tolerance: stops once the relative change of the objective was at most this, `patience` times in a row.
    feasibility: the largest positive constraint with which a design still counts as feasible when the best is chosen.
    stateful: objects with state_dict() and load_state_dict(), such as `ms.WarmStart`, that checkpoints include.
    callback: called with each Record; returning True stops.
    progress: show a bar. checkpoint: a file that is replaced atomically, every `checkpoint_every` iterations and at the
    end. resume: continue from it if it exists, with the same bits as without the stop. A checkpoint of another optimizer,
    of other bounds or options, or of another objective is refused (ValueError says what differs): its best design is
    evaluated once and compared. max_iterations, tolerance, patience and on_jump may be changed.
    The bar, each Record and the printed result say how many designs were evaluated and rejected, and why.

    An objective may raise `ms.DesignRejected` if a design cannot be evaluated; the step is then shortened. If every
    shorter step is rejected too, because the equilibrium jumps, the full step is taken and the jump accepted, provided
    that the objective or one of `stateful` has accept_jumps(), a context manager; the Record says so. With
    on_jump="stop", or without such an object, the minimization ends there.

    Once a design is known, Ctrl-C raises `ms.Interrupted`, and an error in the objective or the callback
    `ms.ObjectiveFailed`; both hold the best design, a MinimizeResult, in `last_good`. Before that the error itself is
    raised.

    >>> import torch, magshell as ms
    >>> x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.LBFGS([x], upper=0.5)
    >>> ms.minimize(lambda x: ((x - 1) ** 2).sum(), [x], optimizer, progress=False).objective
    0.75
    """
    require_torch("minimize")
    if checkpoint_every < 1:
        raise ValueError(f"checkpoint_every must be positive, got {checkpoint_every}")
    if resume and checkpoint is None:
        raise ValueError("resume needs the checkpoint to continue from")
    if on_jump not in ("cross", "stop"):
        raise ValueError(f'on_jump must be "cross" or "stop", got {on_jump!r}')
    ends = _Ends(max_iterations, tolerance, patience, callback)
    run = Run(
        objective, parameters, optimizer, feasibility, stateful, on_jump == "cross", checkpoint is not None
    )
    if resume and Path(checkpoint).exists():
        run.restore(load(checkpoint, PARTS))
    bar = progress_bar("minimize", max_iterations, shown=progress, initial=run.iteration)
    run.watch = _Watch(bar, run)
    try:
        with bar:
            return run.minimum(_loop(run, ends, bar, _Checkpoints(checkpoint, checkpoint_every)))
    except KeyboardInterrupt as error:
        raise Interrupted(
            f"interrupted after {run.iteration} iterations", run.minimum("interrupted")
        ) from error
    except Exception as error:
        if run.best is None:
            raise
        tried = f", with {run.rejected} designs rejected" if isinstance(error, DesignRejected) else ""
        raise ObjectiveFailed(
            f"iteration {run.iteration + 1} failed{tried}: {error}\n"
            "The best design so far is in `error.last_good`, and in the parameters.",
            run.minimum("failed"),
        ) from error


def _loop(run: Run, ends: _Ends, bar, checkpoints: _Checkpoints) -> str:
    """Run iterations until one of the ends is met, and return the reason."""
    if not run.history:
        run.begin()
        reason = ends.reason(run.history)
    else:
        reason = ends.spent(run.history)
    while reason is None:
        try:
            moved = run.advance()
        except EquilibriumJumped as error:
            reason = f"the equilibrium jumps, however short the step: {error} ({run.rejected} designs were rejected)"
        else:
            checkpoints.save(run)
            bar.update()
            bar.set_postfix_str(run.summary())
            log.info("minimize: iteration %d: %s", run.iteration, run.summary())
            reason = ends.reason(run.history, None if moved else run.stagnation)
    checkpoints.save(run, last=True)
    log.info("minimize: ended: %s", reason)
    return reason


@dataclass(frozen=True)
class _Ends:
    """The conditions that end a minimization; arguments as in `minimize`."""

    max_iterations: int
    tolerance: float
    patience: int
    callback: Callable[[Record], bool | None] | None

    def __post_init__(self) -> None:
        count("max_iterations", self.max_iterations, least=0)
        count("patience", self.patience)
        if not self.tolerance >= 0:
            raise ValueError(f"tolerance must not be negative, got {self.tolerance}")

    def reason(self, history: list[Record], stagnation: str | None = None) -> str | None:
        """Return why to end after the last iteration, None to continue. stagnation: why its step changed nothing, if
        it did not."""
        if self.callback is not None and self.callback(history[-1]) is True:
            return "stopped by the callback"
        if stagnation is not None:
            return stagnation
        if self._changes_little(history):
            return "the objective has settled"
        return self.spent(history)

    def spent(self, history: list[Record]) -> str | None:
        """Return the reason of the end if max_iterations is reached, else None."""
        return "max_iterations reached" if history[-1].iteration >= self.max_iterations else None

    def _changes_little(self, history: list[Record]) -> bool:
        """Return whether the last `patience` changes of the objective were within the tolerance."""
        values = [record.objective for record in history[-self.patience - 1 :]]
        changes = [abs(b - a) <= self.tolerance * abs(b) for a, b in pairwise(values)]
        return self.tolerance > 0 and len(changes) == self.patience and all(changes)


@dataclass
class _Watch:
    """A display of the run's state after each evaluation, updated no more often than one can read."""

    bar: Any
    run: Run
    shown: float = -math.inf

    def __call__(self) -> None:
        if time.monotonic() - self.shown > _TIME_TO_READ:
            self.bar.set_postfix_str(self.run.summary())
            self.shown = time.monotonic()


@dataclass
class _Checkpoints:
    """A writer of checkpoints every few iterations; without a path it does nothing."""

    path: str | Path | None
    every: int
    saved: int = 0

    def save(self, run: Run, last: bool = False) -> None:
        due = run.iteration > self.saved and (last or run.iteration % self.every == 0)
        if self.path is not None and due:
            save(self.path, run.snapshot())
            self.saved = run.iteration
