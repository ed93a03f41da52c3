"""The method of moving asymptotes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .approximation import Approximation, Asymptotes, stacked, step_bounds
from .base import BoxOptimizer, Restoring, require_range
from .box import Box
from .sample import Sample

_CONVEXITY = 1e-6  # of the steepest slope so far: damps steps once the gradient has all but vanished


class MMA(BoxOptimizer):
    """The method of moving asymptotes, with bounds and any number of constraints g <= 0.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these
    each.
    scale: the typical size of a variable, in the same forms; by default upper - lower. Without finite bounds
    it is needed.
    move: the longest step of a variable, in sizes. asymptote_initial: first distance of the asymptotes, in
    sizes;
    asymptote_shrink, asymptote_grow: its factors after an oscillation and after progress.
    penalty: the price of breaking a constraint by as much as its slope would change it over a size, in units
    of the same
    change of the objective; only a design that cannot keep its constraints pays it.

    Every option but penalty can differ between parameter groups. K. Svanberg, The method of moving
    asymptotes, Int. J. Numer. Meth. Eng.
    24 (1987), with the asymptotes and the subproblem as in his notes of 2007.

    >>> x = torch.full((5,), 5.0, dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.MMA([x], lower=1.0, upper=10.0)
    >>> optimizer.step(lambda: (x.sum(), (61 / x[0] ** 3 - 1)[None]))  # doctest: +SKIP
    """

    _copied = (*BoxOptimizer._copied, "penalty")

    def __init__(
        self,
        params,
        *,
        lower=-math.inf,
        upper=math.inf,
        scale=None,
        move: float = 1.0,
        asymptote_initial: float = 0.5,
        asymptote_shrink: float = 0.7,
        asymptote_grow: float = 1.2,
        penalty: float = 1000.0,
    ):
        if not (math.isfinite(penalty) and penalty > 0):
            raise ValueError(f"penalty must be positive and finite, got {penalty}")
        self.penalty = float(penalty)
        super().__init__(
            params,
            {
                "lower": lower,
                "upper": upper,
                "scale": scale,
                "move": move,
                "asymptote_initial": asymptote_initial,
                "asymptote_shrink": asymptote_shrink,
                "asymptote_grow": asymptote_grow,
            },
        )

    def step(self, closure: Callable) -> float:
        """Moves to the minimizer of the approximations and returns the objective there."""
        sample = self.evaluate(closure)
        with Restoring(self):
            self._advance(sample, self._box(), self._sample_x)
        return self._sample.objective

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        free = box.free
        values, slopes = stacked(sample, box.scale, free)
        sizes = self._sizes(slopes)
        distance = self._distance(x, box)
        approximation = Approximation.of(values, slopes, distance[free], _CONVEXITY * sizes)
        lower, upper = step_bounds(x, box, free, distance[free], self._option("move")[free])
        t = approximation.subproblem(lower, upper, sizes, self.penalty).solve()
        reached, trial = self._trial(stepped(x, t, box))
        self._commit(x, reached, trial.differentiate(), distance, float(sizes[0]))

    def _commit(
        self, x: np.ndarray, reached: np.ndarray, sample: Sample, distance: np.ndarray, size: float
    ) -> None:
        self._run = {"before": x, "before_that": self._run.get("before"), "distance": distance, "size": size}
        self._keep(reached, sample)

    def _sizes(self, slopes: np.ndarray) -> np.ndarray:
        """(1 + m,) steepest slope of each function; the objective's over the whole run, for it vanishes at a
        minimum."""
        sizes = np.abs(slopes).max(axis=1, initial=0.0)
        sizes[0] = max(sizes[0], self._run.get("size", 0.0))
        return np.where(sizes > 0, sizes, 1.0)

    def _distance(self, x: np.ndarray, box: Box) -> np.ndarray:
        options = Asymptotes(*(self._option(f"asymptote_{name}") for name in ("initial", "shrink", "grow")))
        before, before_that = self._run.get("before"), self._run.get("before_that")
        if before_that is None:
            return options.distance(None, None, None)
        return options.distance(self._run["distance"], x - before, before - before_that)

    def _check_group(self, group: dict, box: Box) -> None:
        require_range(group, "move", 0.0, math.inf)
        require_range(group, "asymptote_initial", 0.0, 10.0)
        require_range(group, "asymptote_shrink", 0.0, 1.0)
        require_range(group, "asymptote_grow", 1.0, 10.0)
        if np.isnan(box.scale).any():
            entry = int(np.isnan(box.scale).argmax())
            raise ValueError(
                f"{box.name_of(entry)} is not bounded on both sides: "
                "give `scale`, the size of a large change of it"
            )


def stepped(x: np.ndarray, t: np.ndarray, box: Box) -> np.ndarray:
    """The design after the step t of its free entries, never outside the box by a rounding."""
    free = box.free
    moved = x.copy()
    moved[free] += t * box.scale[free]
    return np.clip(moved, box.lower, box.upper)
