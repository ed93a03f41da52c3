"""Limited-memory BFGS within bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from .base import BoxOptimizer, Restoring
from .box import Box
from .cauchy import cauchy_step, subspace_step
from .curvature import Curvature, remembered
from .line_search import Probe, strong_wolfe
from .mma import stepped

_FIRST_CHANGE = 0.1  # of the steepest variable's size, before any curvature is known

_ROUNDING = 4 * np.finfo(float).eps  # of the objective: a smaller decrease cannot be seen


class LBFGS(BoxOptimizer):
    """L-BFGS-B: the generalized Cauchy point of a limited-memory model, its minimum over the free variables,
    and a
    line search for the strong Wolfe conditions within the box. It has no other constraints.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these
    each.
    scale: the typical size of a variable, in the same forms; by default upper - lower where both are finite
    and 1 where not.
    memory: how many steps the model is made from.

    Byrd, Lu, Nocedal, Zhu, A limited memory algorithm for bound constrained optimization, SIAM J. Sci.
    Comput. 16 (1995).

    >>> x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    >>> ms.optim.LBFGS([x], upper=0.5).step(lambda: ((x - 1) ** 2).sum())  # doctest: +SKIP
    """

    _copied = (*BoxOptimizer._copied, "memory")

    def __init__(self, params, *, lower=-math.inf, upper=math.inf, scale=None, memory: int = 10):
        if not (isinstance(memory, int) and memory > 0):
            raise ValueError(f"memory must be a positive integer, got {memory!r}")
        self.memory = memory
        super().__init__(params, {"lower": lower, "upper": upper, "scale": scale})

    def step(self, closure: Callable) -> float:
        """Moves to a lower design and returns its objective; stays where it is at a minimum, to rounding."""
        sample = self.evaluate(closure)
        if len(sample.constraints):
            raise ValueError("LBFGS has bounds but no other constraints: use MMA or GCMMA, or add a penalty")
        with Restoring(self):
            self._advance(self._box(), self._sample_x)
        return self._sample.objective

    def _advance(self, box: Box, x: np.ndarray) -> None:
        free = box.free
        scale = np.where(np.isnan(box.scale), 1.0, box.scale)[free]
        gradient = self._sample.gradient[free] * scale
        none = np.zeros((0, gradient.size))
        pairs = (self._run.get("steps", none), self._run.get("changes", none))
        lower, upper = (box.lower - x)[free] / scale, (box.upper - x)[free] / scale

        reached = self._search(x, gradient, scale, box, lower, upper, pairs)
        if reached is None and len(pairs[0]):  # the model may be stale: once more along the gradient itself
            pairs = (none, none)
            reached = self._search(x, gradient, scale, box, lower, upper, pairs)
        if reached is None:
            self._write(x)
            self._leave_gradients(self._sample.gradient)
            return
        moved, sample = reached
        step = (moved - x)[free] / scale
        pairs = remembered(pairs, step, sample.gradient[free] * scale - gradient, self.memory)
        self._write(moved)
        self._leave_gradients(sample.gradient)
        self._run = {"steps": pairs[0], "changes": pairs[1]}
        self._keep(moved, sample)

    def _search(self, x, gradient, scale, box, lower, upper, pairs):
        """(design, sample) of a lower design, or None."""
        model = Curvature(*pairs, _first_theta(gradient, pairs))
        if not np.any(np.where(gradient < 0, upper, -lower) * gradient != 0):
            return None
        cauchy = cauchy_step(gradient, lower, upper, model)
        step = subspace_step(gradient, lower, upper, model, cauchy)
        slope = float(gradient @ step)
        if not -slope > _ROUNDING * abs(self._sample.objective):
            return None
        probe = partial(self._probe, x, step, scale, box)
        start = Probe(0.0, self._sample.objective, slope)
        best = strong_wolfe(probe, start, 1.0, _longest(step, lower, upper))
        return None if best is None else best.found

    def _probe(self, x: np.ndarray, step: np.ndarray, scale: np.ndarray, box: Box, length: float) -> Probe:
        sized = Box(box.lower, box.upper, _spread(scale, box), box.names, box.sizes)
        moved, trial = self._trial(stepped(x, length * step, sized))
        sample = trial.differentiate()
        return Probe(
            length, sample.objective, float(sample.gradient[box.free] * scale @ step), (moved, sample)
        )


def _first_theta(gradient: np.ndarray, pairs: tuple[np.ndarray, np.ndarray]) -> float:
    steps, changes = pairs
    if len(steps) == 0:
        return float(np.abs(gradient).max(initial=0.0)) / _FIRST_CHANGE or 1.0
    return float(changes[-1] @ changes[-1] / (steps[-1] @ changes[-1]))


def _longest(step: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """How often the step fits into the box; at least once, for it ends inside."""
    with np.errstate(divide="ignore", invalid="ignore"):
        fits = np.where(step > 0, upper / step, np.where(step < 0, lower / step, np.inf))
    return max(1.0, float(fits.min(initial=np.inf)))


def _spread(scale: np.ndarray, box: Box) -> np.ndarray:
    whole = np.ones_like(box.lower)
    whole[box.free] = scale
    return whole
