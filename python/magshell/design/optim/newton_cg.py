"""The truncated Newton method with bounds: conjugate gradients on products with the Hessian."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._runtime.solver_entry_point import grouped
from .base import positive_count
from .box import Box
from .curved_sample import CurvedSample, CurvedTrial
from .quadratic_model import QuadraticModel
from .trust_region import TrustRegionOptimizer

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class NewtonCG(TrustRegionOptimizer):
    """Truncated Newton: minimizes a quadratic model by conjugate gradients, with bounds and no other constraints.

    The model has the Hessian of the objective, through the equilibria in it, by products H s alone: `create_graph=True` of
    solves. It takes fewer designs than LBFGS, and converges superlinearly. But a product takes as long as a quick solve:
    five back-substitutions and some twenty evaluations of the stiffness for each load case. So it pays where solves are
    hard, or where the last digits of a minimum count. Where the objective is a sum of squares of few residuals, choose
    GaussNewton. Negative curvature is followed to the radius of the trust region.

    lower, upper: bounds of a group: a number, a tensor that fits each parameter, or a list with one of these each.
    scale: the typical size of a variable, in the same forms; by default upper - lower where both are finite, else 1.
    max_products: products with the Hessian that the conjugate gradients of one step may take. A step takes at least three
        more: two for the point at which they begin, and one at their end.
    first_step: first radius of the trust region: the root mean square of the steps of all variables, in units of `scale`.
        Choose a small one, such as 0.01, if a solve from the last design gets lost far from it.
    max_evaluations: of the closure in one step; after as many without a lower design the search ends.
    max_backtracks: how often a step to a design that the closure rejects is shortened, each time to a quarter.

    An objective without second derivatives raises NoGradient: motions have none, nor have scenes with rigid bodies, own
    fields or friction. `hessian_products` is the number of products taken so far; that of a copy begins at 0.

    S. G. Nash, A survey of truncated-Newton methods, J. Comput. Appl. Math. 124 (2000); T. Steihaug, SIAM J. Numer. Anal. 20
    (1983); bounds as C.-J. Lin, J. J. More, SIAM J. Optim. 9 (1999).

    params: tensors, or groups of them, as torch's optimizers take.

    >>> import torch, magshell as ms
    >>> x = torch.tensor([-1.2, 0.4], dtype=torch.float64, requires_grad=True)
    >>> optimizer = ms.optim.NewtonCG([x], upper=0.5)
    >>> def rosenbrock():
    ...     return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2
    >>> for _ in range(20):
    ...     objective = optimizer.step(rosenbrock)
    >>> round(objective, 6)  # at (0.5, 0.25)
    0.25
    """

    max_products: int
    hessian_products: int = 0
    _sample_type = CurvedSample

    _copied_attributes = (*TrustRegionOptimizer._copied_attributes, "max_products")

    @grouped()
    def __init__(
        self,
        params: Iterable[Any],
        *,
        lower: Numbers = -math.inf,
        upper: Numbers = math.inf,
        scale: Numbers | None = None,
        max_products: int = 50,
        first_step: float = 1.0,
        max_evaluations: int = 20,
        max_backtracks: int = 6,
    ):
        self.max_products = positive_count("max_products", max_products)
        options = {"lower": lower, "upper": upper, "scale": scale}
        super().__init__(params, options, first_step, max_evaluations, max_backtracks)

    def trial_of(self, closure: Callable[..., Any]) -> CurvedTrial:
        return CurvedTrial(closure, self.parameters)

    def _model(self, sample: CurvedSample, box: Box, size: np.ndarray) -> QuadraticModel:
        free, trial = box.free, sample.products

        def times(step: np.ndarray) -> np.ndarray:
            whole = np.zeros(free.size)
            whole[free] = step * size
            self.hessian_products += 1
            return trial.hessian_times(whole)[free] * size

        if trial.model is None:
            trial.model = HessianModel(times, sample.gradient[free] * size, self.max_products)
        return trial.model


class HessianModel(QuadraticModel):
    """A quadratic model whose Hessian H (n, n) is given by products.

    times: returns H s of a step s, which is its image. gradient: (n,). max_products: that conjugate gradients take at most.
    """

    def __init__(self, times: Callable[[np.ndarray], np.ndarray], gradient: np.ndarray, max_products: int):
        super().__init__(gradient, max_products)
        self._times = times

    def _image(self, step: np.ndarray) -> np.ndarray:
        return self._times(step)

    def _curvature(self, step: np.ndarray, image: np.ndarray) -> float:
        return float(step @ image)

    def _bent(self, image: np.ndarray) -> np.ndarray:
        return image

    def _no_image(self) -> np.ndarray:
        return np.zeros_like(self._gradient)
