"""The Gauss-Newton method with bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ...errors import DesignRejected
from .base import BoxOptimizer
from .box import Box
from .least_squares import DenseModel, ResidualModel
from .least_squares_products import ProductModel
from .residual_sample import ResidualSample, ResidualTrial
from .sample import Sample
from .stagnation import STAGNATION

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

# [Nocedal and Wright 2006, algorithm 4.1]: a step is taken if the decrease is at least the first fraction [-] of the one
# expected; the radius shrinks to a quarter below the second, and doubles above the third.
_ACCEPTED, _POOR, _GOOD = 1e-4, 0.25, 0.75
_SHORTER, _LONGER = 0.25, 2.0
_AT_RADIUS = 0.8  # [-] a step that is at least this fraction of the radius was limited by it
_ROUNDING = 4 * np.finfo(float).eps  # [-] a relative decrease of the objective below this is round-off
_JACOBIANS = ("auto", "forward", "backward", "products")


class GaussNewton(BoxOptimizer):
    """Gauss-Newton and Levenberg-Marquardt: least squares of residuals, with bounds and no other constraints.

    The closure returns residuals r, a tensor (m,), and the objective is |r|^2 / 2. Each step minimizes the linear model
    |r + J s|^2 within the bounds and within a trust region, whose radius follows how well the model predicts the decrease.
    Near a minimum with zero residuals it converges quadratically, with small ones fast; a fit takes ten evaluations where
    L-BFGS takes a hundred.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these each.
    scale: the typical size of a variable, in the same forms; by default upper - lower where both are finite, else 1.
    jacobian: how J is found. "backward" by rows, m gradients; "forward" by columns, n tangents (not through motions);
        "products" not at all: conjugate gradients with products J s and J^T r. "auto" takes columns if 3 n < m, as
        a tangent costs about three gradients, else rows; and products if both m and n exceed 2000.
    first_step: first radius of the trust region: the root mean square of the steps of all variables, in sizes.
    max_evaluations: of the closure in one step; after as many without a lower design the search ends.
    max_backtracks: how often a step to a design that the closure rejects is shortened, each time to a quarter.

    scipy.optimize.least_squares minimizes the same. It cannot be stopped and continued, knows neither rejected designs nor
    jumps of an equilibrium, and takes its Jacobian as a matrix or an operator, not from tensors.

    J. J. More, The Levenberg-Marquardt algorithm (1978); J. Nocedal, S. J. Wright, Numerical Optimization (2006), 4.1 and
    10.3; for many residuals of many variables C.-J. Lin, J. J. More, SIAM J. Optim. 9 (1999).

    params: tensors, or groups of them, as torch's optimizers take.

    >>> import torch, magshell as ms
    >>> x = torch.tensor([-1.2, 0.4], dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.GaussNewton([x], upper=0.5)
    >>> def rosenbrock():
    ...     return torch.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])
    >>> for _ in range(20):
    ...     half_of_squares = optimizer.step(rosenbrock)
    >>> round(half_of_squares, 6)  # at (0.5, 0.25)
    0.125
    """

    jacobian: str
    first_step: float
    max_evaluations: int
    takes_residuals = True
    _sample_type = ResidualSample

    _copied_attributes = (*BoxOptimizer._copied_attributes, "jacobian", "first_step", "max_evaluations")

    @grouped()
    def __init__(
        self,
        params: Iterable[Any],
        *,
        lower: Numbers = -math.inf,
        upper: Numbers = math.inf,
        scale: Numbers | None = None,
        jacobian: str = "auto",
        first_step: float = 1.0,
        max_evaluations: int = 20,
        max_backtracks: int = 6,
    ):
        if jacobian not in _JACOBIANS:
            raise ValueError(f"jacobian must be one of {', '.join(map(repr, _JACOBIANS))}, got {jacobian!r}")
        if isinstance(max_evaluations, bool) or not (
            isinstance(max_evaluations, int) and max_evaluations > 0
        ):
            raise ValueError(f"max_evaluations must be a positive integer, got {max_evaluations!r}")
        self.jacobian, self.first_step = jacobian, positive("first_step", "", first_step)
        self.max_evaluations = max_evaluations
        super().__init__(params, {"lower": lower, "upper": upper, "scale": scale}, max_backtracks)

    def trial_of(self, closure: Callable[..., Any]) -> ResidualTrial:
        return ResidualTrial(closure, self.parameters, self.jacobian)

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
        model = _model(sample, box, size)
        radius = self._run.get("radius", self.first_step * math.sqrt(size.size))
        rejected = 0
        for _ in range(self.max_evaluations):
            step = model.step(lower, upper, radius)
            expected, length = model.decrease(step), float(np.linalg.norm(step))
            if not expected > _ROUNDING * sample.objective:
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
        radius = self._run.get("radius", self.first_step * math.sqrt(size.size))
        step = _model(sample, box, size).step(lower, upper, radius)
        reached, trial = self._trial(box.moved(x, step * size))
        self._store(reached, trial.differentiate())
        self._leave_gradients(self._sample.gradient)


def _in_sizes(box: Box, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the sizes of the free entries, and the bounds of a step in these sizes, each (n free,)."""
    size = np.where(np.isnan(box.scale), 1.0, box.scale)[box.free]
    return size, (box.lower - x)[box.free] / size, (box.upper - x)[box.free] / size


def _model(sample: ResidualSample, box: Box, size: np.ndarray) -> ResidualModel:
    """Return the linear model of the residuals for steps of the free entries in their sizes."""
    free, trial = box.free, sample.products
    if trial is None:
        return DenseModel(sample.slopes[:, free] * size, sample.residuals)

    def times(step: np.ndarray) -> np.ndarray:
        whole = np.zeros(free.size)
        whole[free] = step * size
        return trial.times(whole)

    def transposed_times(weights: np.ndarray) -> np.ndarray:
        return trial.transposed_times(weights)[free] * size

    if trial.model is None:
        trial.model = ProductModel(times, transposed_times, sample.residuals, sample.gradient[free] * size)
    return trial.model


def _next_radius(radius: float, length: float, fraction: float) -> float:
    """Return the radius after a step of this length whose decrease was this fraction of the expected one."""
    if not fraction >= _POOR:
        return _SHORTER * length
    return _LONGER * radius if fraction > _GOOD and length > _AT_RADIUS * radius else radius
