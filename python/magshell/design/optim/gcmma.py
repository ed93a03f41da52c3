"""The globally convergent method of moving asymptotes."""

from __future__ import annotations

import numpy as np

from ...errors import DesignRejected
from .approximation import ApproximationData
from .box import Box
from .mma import MMA
from .sample import Sample

_INNER_LIMIT = 15
_ROUNDING = 1e-12  # [-] round-off of a function relative to its values and to ten times its slope
_SMALLEST_CONVEXITY = 1e-6  # [-] relative to a function's steepest slope


class GCMMA(MMA):
    """MMA that takes a step only if its approximations lie above the functions there; options as `ms.optim.MMA`.

    If an approximation does not, it is made more convex and the subproblem is solved again: each such inner iteration
    costs one evaluation without gradients. If the closure rejects a design, all approximations are made so much more
    convex that the step is half as long. At a minimum, to rounding, the parameters stay. From a design that satisfies the
    constraints, every step satisfies them and lowers the objective.

    K. Svanberg, A class of globally convergent optimization methods ..., SIAM J. Optim. 12 (2002).

    params, lower, upper, scale, move, asymptote_initial, penalty, max_backtracks and the rest: as in `optim.MMA`.

    >>> import torch, magshell as ms
    >>> x = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.GCMMA([x], lower=-1.0, upper=0.5)
    >>> for _ in range(10):
    ...     weight = optimizer.step(lambda: ((x - 1) ** 2).sum())
    >>> round(weight, 6)
    0.75
    """

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        around, distance = self._surroundings(sample, box, x)
        convexity = self._first_convexity(around)
        steepest = np.abs(around.slopes).max(axis=1, initial=0.0)
        approximation, t = around.step(convexity, self.penalty)
        rejected = 0
        for _ in range(_INNER_LIMIT + self.max_backtracks):
            try:
                reached, trial = self._trial(box.moved(x, t * around.scale))
            except DesignRejected:
                rejected += 1
                if rejected > self.max_backtracks:
                    raise
                longest = 0.5 * np.abs(t).max()
                while np.abs(t).max() > longest:
                    convexity = 4 * convexity
                    approximation, t = around.step(convexity, self.penalty)
                continue
            t = (reached - x)[box.free] / around.scale
            actual = np.concatenate([[trial.objective], trial.constraints])
            missing = actual - approximation.at(t)
            rounding = _ROUNDING * (np.maximum(np.abs(actual), np.abs(around.values)) + 10 * steepest)
            if (missing <= rounding).all():
                self._commit(x, reached, trial.differentiate(), distance, around.size)
                return
            convexity = _more_convex(convexity, missing, t, around.distance)
            approximation, t = around.step(convexity, self.penalty)
        self._write(x)  # the differences are round-off of the functions: a minimum
        self._leave_gradients(sample.gradient)

    def _first_convexity(self, around: ApproximationData) -> np.ndarray:
        """Return the first convexities rho, (1 + m,). [Svanberg 2002] (4.8)"""
        return np.maximum(0.1 * np.abs(around.slopes).mean(axis=1), _SMALLEST_CONVEXITY * around.sizes)


def _more_convex(
    convexity: np.ndarray, missing: np.ndarray, t: np.ndarray, distance: np.ndarray
) -> np.ndarray:
    """Return convexities that close the gap at t, with a tenth to spare, at most ten times the old ones. [Svanberg
    2002] (4.9)"""
    gain = 2 * float(
        (distance * t**2 / (distance**2 - t**2)).sum()
    )  # increase of the approximation per unit of convexity
    needed = missing / gain if gain > 0 else np.full_like(missing, np.inf)
    return np.where(missing > 0, np.minimum(10 * convexity, 1.1 * (convexity + needed)), convexity)
