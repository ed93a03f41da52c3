"""The globally convergent form of the method of moving asymptotes."""

from __future__ import annotations

import numpy as np

from .approximation import Approximation, stacked, step_bounds
from .box import Box
from .mma import MMA, stepped
from .sample import Sample

_INNER_LIMIT = 15
_ROUNDING = 1e-12  # of a function's values, and ten times that of its slope: below, a difference says nothing
_SMALLEST_CONVEXITY = 1e-6  # of a function's steepest slope


class GCMMA(MMA):
    """MMA that takes a step only where its approximations lie above the functions; options as `ms.optim.MMA`.

    Where one does not, it is made more convex and the subproblem solved again: each such inner iteration
    costs one
    evaluation without gradients. At a minimum, to rounding, a step stays where it is. From a design that
    keeps the constraints every step keeps them and lowers the objective.
    K. Svanberg, A class of globally convergent optimization methods ..., SIAM J. Optim. 12 (2002).
    """

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        free = box.free
        values, slopes = stacked(sample, box.scale, free)
        sizes = self._sizes(slopes)
        distance = self._distance(x, box)
        lower, upper = step_bounds(x, box, free, distance[free], self._option("move")[free])
        # [Svanberg 2002] (4.8)
        convexity = np.maximum(0.1 * np.abs(slopes).mean(axis=1), _SMALLEST_CONVEXITY * sizes)
        steepest = np.abs(slopes).max(axis=1, initial=0.0)
        for _ in range(_INNER_LIMIT):
            approximation = Approximation.of(values, slopes, distance[free], convexity)
            t = approximation.subproblem(lower, upper, np.maximum(sizes, convexity), self.penalty).solve()
            reached, trial = self._trial(stepped(x, t, box))
            t = (reached - x)[free] / box.scale[free]
            actual = np.concatenate([[trial.objective], trial.constraints])
            missing = actual - approximation.at(t)
            if (missing <= _ROUNDING * (np.maximum(np.abs(actual), np.abs(values)) + 10 * steepest)).all():
                self._commit(x, reached, trial.differentiate(), distance, float(sizes[0]))
                return
            convexity = _more_convex(convexity, missing, t, distance[free])
        self._write(x)  # the functions' own rounding is all that is left: a minimum
        self._leave_gradients(sample.gradient)


def _more_convex(
    convexity: np.ndarray, missing: np.ndarray, t: np.ndarray, distance: np.ndarray
) -> np.ndarray:
    """[Svanberg 2002] (4.9): enough to close the gap at t, with a tenth to spare, and at most ten times what
    it was."""
    gain = 2 * float(
        (distance * t**2 / (distance**2 - t**2)).sum()
    )  # of the approximation, a unit of convexity
    needed = missing / gain if gain > 0 else np.full_like(missing, np.inf)
    raised = np.minimum(10 * convexity, 1.1 * (convexity + needed))
    return np.where(missing > 0, raised, convexity)
