"""The Gauss-Newton method with bounds, and its model of a sum of squares by products."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.solver_entry_point import grouped
from .box import Box
from .dense_model import DenseModel
from .quadratic_model import QuadraticModel
from .residual_sample import ResidualSample, ResidualTrial
from .trust_region import StepModel, TrustRegionOptimizer

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_JACOBIANS = ("auto", "forward", "backward", "products")

# Conjugate gradients take as many products at most. Tested by test_products_reach_the_same_minimum.
_PRODUCTS = 100


class GaussNewton(TrustRegionOptimizer):
    """Gauss-Newton and Levenberg-Marquardt: least squares of residuals, with bounds and no other constraints.

    The closure returns residuals r, a tensor (m,), and the objective is |r|^2 / 2. Each step minimizes the linear model
    |r + J s|^2 within the bounds and within a trust region, whose radius follows how well the model predicts the decrease.
    Near a minimum with zero residuals it converges quadratically, with small ones fast; a fit takes ten evaluations where
    L-BFGS takes a hundred.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these each.
    scale: the typical size of a variable, in the same forms; by default upper - lower where both are finite, else 1.
    jacobian: how J is found. "backward" by rows, m gradients; "forward" by columns, n tangents;
        "products" not at all: conjugate gradients with products J s and J^T r. "auto" takes columns if 3 n < m, as
        a tangent costs about three gradients, else rows; and products if both m and n exceed 2000, or if a factorization of
        J takes longer than a second, at min(m, n)^2 max(m, n) > 2e9.
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
    takes_residuals = True
    _sample_type = ResidualSample

    _copied_attributes = (*TrustRegionOptimizer._copied_attributes, "jacobian")

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
        self.jacobian = jacobian
        options = {"lower": lower, "upper": upper, "scale": scale}
        super().__init__(params, options, first_step, max_evaluations, max_backtracks)

    def trial_of(self, closure: Callable[..., Any]) -> ResidualTrial:
        return ResidualTrial(closure, self.parameters, self.jacobian)

    def _model(self, sample: ResidualSample, box: Box, size: np.ndarray) -> StepModel:
        """Return the linear model of the residuals."""
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
            trial.model = ProductModel(
                times, transposed_times, sample.residuals, sample.gradient[free] * size
            )
        return trial.model


class ProductModel(QuadraticModel):
    """Half of the squares |J s + r|^2 of residuals r (m,), by functions that multiply J (m, n) and its transpose."""

    def __init__(
        self,
        times: Callable[[np.ndarray], np.ndarray],
        transposed_times: Callable[[np.ndarray], np.ndarray],
        residuals: np.ndarray,
        gradient: np.ndarray,
    ):
        super().__init__(gradient, _PRODUCTS)
        self._times, self._transposed_times, self._residuals = times, transposed_times, residuals

    def _image(self, step: np.ndarray) -> np.ndarray:
        return self._times(step)

    def _curvature(self, step: np.ndarray, image: np.ndarray) -> float:
        return float(image @ image)

    def _bent(self, image: np.ndarray) -> np.ndarray:
        return self._transposed_times(image)

    def _no_image(self) -> np.ndarray:
        return np.zeros_like(self._residuals)
