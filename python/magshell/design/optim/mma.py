"""The method of moving asymptotes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ...errors import DesignRejected
from .approximation import ApproximationData, Asymptotes
from .base import BoxOptimizer, require_range
from .box import Box
from .sample import Sample

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


_DECAY = 0.5  # [-] factor per step of the steepest slope so far: a single extreme design must not set the scale forever
_CONVEXITY = (
    1e-6  # [-] relative to the steepest slope so far: damps steps once the gradient has almost vanished
)


class MMA(BoxOptimizer):
    """The method of moving asymptotes, with bounds and any number of constraints g <= 0.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these each.
    scale: the typical size of a variable, in the same forms; by default upper - lower, and needed without finite bounds.
    move: the longest step of a variable, in sizes. asymptote_initial: first distance of the asymptotes, in sizes;
    asymptote_shrink, asymptote_grow: its factors after an oscillation and after progress.
    penalty: the cost of breaking a constraint by as much as its slope would change it over a size, in units of the same
    change of the objective; it matters only for a design that cannot satisfy its constraints.
    max_backtracks: how often a step to a design that the closure rejects is halved.

    Every option but the last two can differ between parameter groups. K. Svanberg, The method of moving asymptotes,
    Int. J. Numer. Meth. Eng. 24 (1987), with the asymptotes and the subproblem as in his notes of 2007.

    params: tensors, or groups of them, as torch's optimizers take.

    >>> import torch, magshell as ms
    >>> x = torch.full((5,), 5.0, dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.MMA([x], lower=1.0, upper=10.0)
    >>> for _ in range(10):
    ...     weight = optimizer.step(lambda: (x.sum(), (61 / x[0] ** 3 - 1)[None]))
    >>> round(weight, 4)  # 61^(1/3) + 4
    7.9365
    """

    _copied_attributes = (*BoxOptimizer._copied_attributes, "penalty")

    @grouped()
    def __init__(
        self,
        params: Iterable[Any],
        *,
        lower: Numbers = -math.inf,
        upper: Numbers = math.inf,
        scale: Numbers | None = None,
        move: float = 1.0,
        asymptote_initial: float = 0.5,
        asymptote_shrink: float = 0.7,
        asymptote_grow: float = 1.2,
        penalty: float = 1000.0,
        max_backtracks: int = 6,
    ):
        self.penalty: float = positive("penalty", "", penalty)
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
            max_backtracks,
        )

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        around, distance = self._surroundings(sample, box, x)
        _, t = around.step(self._first_convexity(around), self.penalty)
        for shortening in range(self.max_backtracks + 1):
            fraction = 0.5**shortening
            try:
                reached, trial = self._trial(box.moved(x, fraction * t * around.scale))
            except DesignRejected:
                if shortening == self.max_backtracks:
                    raise
            else:
                self._commit(x, reached, trial.differentiate(), distance, around.size)
                return

    def _full_step(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        around, distance = self._surroundings(sample, box, x)
        _, t = around.step(self._first_convexity(around), self.penalty)
        reached, trial = self._trial(box.moved(x, t * around.scale))
        self._commit(x, reached, trial.differentiate(), distance, around.size)

    def _surroundings(self, sample: Sample, box: Box, x: np.ndarray) -> tuple[ApproximationData, np.ndarray]:
        """Return the data of the approximations over the free entries, and the asymptotes' distances, (n,)."""
        distance = self._distance(x, box)
        steepest = _DECAY * self._run.get("size", 0.0)
        return ApproximationData.of(sample, box, x, distance, self._option("move"), steepest), distance

    def _first_convexity(self, around: ApproximationData) -> np.ndarray:
        """Return the convexities rho of the first approximations, (1 + m,)."""
        return _CONVEXITY * around.sizes

    def _commit(
        self, x: np.ndarray, reached: np.ndarray, sample: Sample, distance: np.ndarray, size: float
    ) -> None:
        """Store the design and sample that a step has reached, and the state for the next step."""
        self._run = {"before": x, "before_that": self._run.get("before"), "distance": distance, "size": size}
        self._store(reached, sample)

    def _distance(self, x: np.ndarray, box: Box) -> np.ndarray:
        """Return the distances of the asymptotes, (n,), from the last two steps."""
        options = Asymptotes(*(self._option(f"asymptote_{name}") for name in ("initial", "shrink", "grow")))
        before, before_that = self._run.get("before"), self._run.get("before_that")
        if before_that is None:
            return options.initial.copy()
        return options.distance(self._run["distance"], x - before, before - before_that)

    def _check_group(self, group: dict[Any, Any], box: Box) -> None:
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
