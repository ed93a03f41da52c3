"""Base class of the optimizers that minimize a model of the objective within bounds and a trust region."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np

from ..._input.scalars import positive
from ...errors import DesignRejected
from .base import BoxOptimizer, positive_count
from .box import Box
from .sample import STAGNATION, Sample

# [Nocedal and Wright 2006, algorithm 4.1]: a step is taken if the decrease is at least the first fraction [-] of the one
# expected; the radius shrinks to a quarter below the second, and doubles above the third.
_ACCEPTED, _POOR, _GOOD = 1e-4, 0.25, 0.75
_SHORTER, _LONGER = 0.25, 2.0
_AT_RADIUS = 0.8  # [-] a step that is at least this fraction of the radius was limited by it
_ROUNDING = 4 * np.finfo(float).eps  # [-] a relative decrease of the objective below this is round-off

# [-] Largest first radius, in sizes, whose square is a number; see test_first_steps_beyond_all_numbers_are_refused.
_LARGEST_STEP = 1e100


class StepModel(Protocol):
    """A model of the objective about a design, for steps in the sizes of the variables."""

    def decrease(self, step: np.ndarray) -> float:
        """Return by how much a step lowers the objective."""
        ...

    def step(self, lower: np.ndarray, upper: np.ndarray, radius: float) -> np.ndarray:
        """Return a step (n,) within the bounds lower <= 0 <= upper and the radius that lowers the model."""
        ...


class TrustRegionOptimizer(BoxOptimizer):
    """An optimizer whose steps minimize a model within bounds and a trust region.

    The radius follows how well the model predicts the decrease of the objective. A subclass defines `_model`, and a sample
    with the attribute `products`: the graph from which products with derivatives are taken, or None.

    first_step: first radius: the root mean square of the steps of all variables, in sizes.
    max_evaluations: of the closure in one step; after as many without a lower design the search ends.
    """

    first_step: float
    max_evaluations: int

    _copied_attributes = (*BoxOptimizer._copied_attributes, "first_step", "max_evaluations")

    def __init__(
        self,
        params: Iterable[Any],
        defaults: dict[Any, Any],
        first_step: float,
        max_evaluations: int,
        max_backtracks: int,
    ):
        self.first_step = positive("first_step", "", first_step)
        if self.first_step > _LARGEST_STEP:
            raise ValueError(f"first_step must be at most {_LARGEST_STEP:g} sizes, got {first_step:g}")
        self.max_evaluations = positive_count("max_evaluations", max_evaluations)
        super().__init__(params, defaults, max_backtracks)

    @abstractmethod
    def _model(self, sample: Sample, box: Box, size: np.ndarray) -> StepModel:
        """Return the model about a design, for steps of the free entries in these sizes."""

    def __getstate__(self) -> dict[Any, Any]:
        state = super().__getstate__()
        if not self._sample_state():  # the graph of products is not copied: the closure is called again
            state["_sample"] = None
        return state

    def _sample_state(self) -> dict[Any, Any]:
        if self._sample is None or self._sample.products is not None:
            return {}
        state = super()._sample_state()
        return {name: value for name, value in state.items() if not name.endswith("products")}

    def _advance(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        self.stagnation = STAGNATION
        size, lower, upper = _in_sizes(box, x)
        model, radius = self._model(sample, box, size), self._radius(size)
        rejected = 0
        for _ in range(self.max_evaluations):
            step = model.step(lower, upper, radius)
            expected, length = model.decrease(step), float(np.linalg.norm(step))
            if not expected > _ROUNDING * abs(sample.objective):
                break
            try:
                reached, trial = self._trial(box.moved(x, step * size))
            except DesignRejected:
                rejected += 1
                if rejected > self.max_backtracks:
                    raise
                radius = _SHORTER * length
                continue
            fraction = (sample.objective - trial.objective) / expected
            radius = _next_radius(radius, length, fraction)
            if fraction > _ACCEPTED:
                self._run = {"radius": radius}
                self._store(reached, trial.differentiate())
                self._leave_gradients(self._sample.gradient)
                return
        else:
            self.stagnation: str = (
                "no lower design in as many evaluations of a step as max_evaluations allows, "
                f"{self.max_evaluations}"
            )
        self._write(x)
        self._leave_gradients(sample.gradient)

    def _full_step(self, sample: Sample, box: Box, x: np.ndarray) -> None:
        """Take the step of the model at the present radius, even if the objective grows."""
        size, lower, upper = _in_sizes(box, x)
        step = self._model(sample, box, size).step(lower, upper, self._radius(size))
        reached, trial = self._trial(box.moved(x, step * size))
        self._store(reached, trial.differentiate())
        self._leave_gradients(self._sample.gradient)

    def _radius(self, size: np.ndarray) -> float:
        return self._run.get("radius", self.first_step * math.sqrt(size.size))


def _in_sizes(box: Box, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sizes of the free entries, and the bounds of a step in these sizes, each (n free,)."""
    size = np.where(np.isnan(box.scale), 1.0, box.scale)[box.free]
    return size, (box.lower - x)[box.free] / size, (box.upper - x)[box.free] / size


def _next_radius(radius: float, length: float, fraction: float) -> float:
    """Return the radius after a step of this length whose decrease was this fraction of the expected one."""
    if not fraction >= _POOR:
        return _SHORTER * length
    return _LONGER * radius if fraction > _GOOD and length > _AT_RADIUS * radius else radius
