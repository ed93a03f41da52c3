"""Limited-memory BFGS with bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.solver_entry_point import grouped
from ...errors import DesignRejected
from .base import BoxOptimizer, positive_count
from .box import Box
from .cauchy import Curvature, cauchy_step, shows_curvature, subspace_step, updated_diagonal
from .line_search import Probe, strong_wolfe
from .sample import STAGNATION, Sample

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_ROUNDING = 4 * np.finfo(float).eps  # [-] a relative decrease of the objective below this is round-off


class LBFGS(BoxOptimizer):
    """L-BFGS-B: a quasi-Newton method with bounds and no other constraints.

    A step goes to the generalized Cauchy point of a limited-memory model, then to the model's minimum over the
    free variables, with a line search for the strong Wolfe conditions within the box.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these each.
    scale: the typical size of a variable, in the same forms; by default upper - lower where both are finite, else 1.
    memory: number of steps that the model is made from. The model before these steps is a diagonal, learned from all steps
    so far, so that variables with badly guessed sizes still move together.
    first_step: length of the first trial step of the steepest variable, in sizes. A smaller one costs a few iterations
    more; if an objective is expensive and can be evaluated only nearby, 0.1 is safer.
    max_evaluations: of the closure in one line search; if the search is cut short, its lowest design is taken. If
    evaluations are expensive and the objective has kinks, as for a sheet near a snap, 5 is enough.
    max_backtracks: how often a line search may meet a design that the closure rejects; it counts as higher than any other.

    R. H. Byrd, P. Lu, J. Nocedal, C. Zhu, A limited memory algorithm for bound constrained optimization,
    SIAM J. Sci. Comput. 16 (1995).

    params: tensors, or groups of them, as torch's optimizers take.

    >>> import torch, magshell as ms
    >>> x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    >>> ms.optim.LBFGS([x], upper=0.5).step(lambda: ((x - 1) ** 2).sum())
    0.75
    """

    first_step: float
    max_evaluations: int
    memory: int

    _copied_attributes = (*BoxOptimizer._copied_attributes, "memory", "first_step", "max_evaluations")

    @grouped()
    def __init__(
        self,
        params: Iterable[Any],
        *,
        lower: Numbers = -math.inf,
        upper: Numbers = math.inf,
        scale: Numbers | None = None,
        memory: int = 10,
        first_step: float = 1.0,
        max_evaluations: int = 20,
        max_backtracks: int = 6,
    ):
        self.memory = positive_count("memory", memory)
        self.max_evaluations = positive_count("max_evaluations", max_evaluations)
        if not (isinstance(first_step, int | float) and 0 < first_step < math.inf):
            raise ValueError(f"first_step must be a positive number, got {first_step!r}")
        self.first_step = float(first_step)
        super().__init__(params, {"lower": lower, "upper": upper, "scale": scale}, max_backtracks)

    def _check_sample(self, sample: Sample) -> None:
        if len(sample.constraints):
            raise ValueError("LBFGS has bounds but no other constraints: use MMA or GCMMA, or add a penalty")

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        self.stagnation = STAGNATION
        # If the model finds no descent, it may be outdated: then try again along the gradient.
        for run in (self._run, {}) if self._run else ({},):
            line = self._line(sample, box, x, run)
            found = None if line is None else self._search(line, sample.objective)
            if found is not None:
                moved, reached = found
                self._write(moved)
                self._leave_gradients(reached.gradient)
                self._run = self._learned(run, box, moved - x, reached.gradient - sample.gradient)
                self._store(moved, reached)
                return
        self._write(x)
        self._leave_gradients(sample.gradient)

    def _full_step(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        line = self._line(sample, box, x, self._run)
        if line is not None:
            # The gradient's change across a jump is no curvature: the model is not updated with it.
            moved, trial = self._trial(line.at(1.0))
            self._store(moved, trial.differentiate())

    def _line(self, sample: Sample, box: Box, x: np.ndarray, run: dict[Any, Any]) -> _Line | None:
        """Return the line to the minimum of the model; None if the model does not decrease within the box."""
        stretch = np.sqrt(run["diagonal"]) if run else 1.0
        unit = _sizes(box) / stretch
        gradient = sample.gradient[box.free] * unit
        lower, upper = (box.lower - x)[box.free] / unit, (box.upper - x)[box.free] / unit
        if not (np.where(gradient < 0, upper > 0, lower < 0) & (gradient != 0)).any():
            return None
        if run:
            steps, changes = run["steps"] * stretch, run["changes"] / stretch
            theta = float(changes[-1] @ changes[-1] / (steps[-1] @ changes[-1]))
        else:
            steps = changes = np.zeros((0, gradient.size))
            theta = float(np.abs(gradient).max()) / self.first_step
        model = Curvature(steps, changes, theta)
        step = subspace_step(gradient, lower, upper, model, cauchy_step(gradient, lower, upper, model))
        slope = float(gradient @ step)
        if not -slope > _ROUNDING * abs(sample.objective):
            return None
        return _Line(x, step * unit, slope, _longest(step, lower, upper), box)

    def _search(self, line: _Line, objective: float) -> tuple[np.ndarray, Sample] | None:
        """Return a lower design on the line with its sample, or None. Raises the last rejection if all trial designs
        were rejected."""
        rejections = []
        probes = 0

        def probe(length: float) -> Probe:
            nonlocal probes
            probes += 1
            try:
                moved, trial = self._trial(line.at(length))
            except DesignRejected as error:
                rejections.append(error)
                return Probe(length, math.inf, math.nan)
            sample = trial.differentiate()
            slope = float(sample.gradient[line.box.free] @ line.change)
            return Probe(length, sample.objective, slope, (moved, sample))

        start = Probe(0.0, objective, line.slope)
        limits = {
            "limit": self.max_evaluations - 1,
            "max_rejected": self.max_backtracks,
        }  # after the first one
        best = strong_wolfe(probe, start, 1.0, line.longest, **limits)
        if best is not None:
            return best.found
        if len(rejections) > self.max_backtracks:
            raise rejections[-1]
        if probes == self.max_evaluations:
            self.stagnation: str = (
                f"no lower design in as many evaluations of a line search as max_evaluations allows, {probes}"
            )
        return None

    def _learned(self, run: dict[Any, Any], box: Box, step: np.ndarray, change: np.ndarray) -> dict[Any, Any]:
        """Return the updated model: the last steps and changes of the gradient, (k, n) in units of the sizes, and the
        diagonal."""
        size = _sizes(box)
        step, change = step[box.free] / size, change[box.free] * size
        if not shows_curvature(step, change):
            return run
        return {
            "steps": np.vstack([*run.get("steps", ()), step])[-self.memory :],
            "changes": np.vstack([*run.get("changes", ()), change])[-self.memory :],
            "diagonal": updated_diagonal(run.get("diagonal"), step, change),
        }


@dataclass(frozen=True)
class _Line:
    """The designs x + a change within the box, 0 <= a <= longest; slope: that of the objective at a = 0."""

    x: np.ndarray
    change: np.ndarray
    slope: float
    longest: float
    box: Box

    def at(self, length: float) -> np.ndarray:
        return self.box.moved(self.x, length * self.change)


def _sizes(box: Box) -> np.ndarray:
    """Return the sizes of the free entries, (n free,)."""
    return np.where(np.isnan(box.scale), 1.0, box.scale)[box.free]


def _longest(step: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return how often the step fits into the box; at least once, since it ends inside."""
    with np.errstate(divide="ignore", invalid="ignore"):
        fits = np.where(step > 0, upper / step, np.where(step < 0, lower / step, np.inf))
    return max(1.0, float(fits.min(initial=np.inf)))
