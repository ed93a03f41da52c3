"""The truncated Newton method with bounds: conjugate gradients on products with the Hessian."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from ..._runtime.solver_entry_point import grouped
from ...solve.adjoint.autograd import products
from .base import positive_count
from .box import Box
from .quadratic_model import QuadraticModel
from .sample import Sample, Trial, require_finite
from .trust_region import TrustRegionOptimizer

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@dataclass(frozen=True)
class CurvedSample(Sample):
    """The objective and its gradient at a design, and the graph from which products with the Hessian are taken."""

    products: CurvedTrial | None = None


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


class CurvedTrial(Trial):
    """The value of a closure, with the graph for two derivatives of it."""

    def differentiate(self) -> CurvedSample:
        """Return the sample with the gradient, which keeps its graph.

        Raises ValueError for constraints, and if a parameter does not affect the objective; NoGradient without a gradient.
        """
        if self._constraints is not None:
            raise ValueError(
                "NewtonCG has bounds but no other constraints: use MMA or GCMMA, or add a penalty"
            )
        if not self._objective.requires_grad:
            raise ValueError("the objective does not depend on the parameters: no gradient reaches them")
        ones = torch.ones_like(self._objective)
        found = products([self._objective], self._parameters, [ones], differentiable=True)
        for position, (each, parameter) in enumerate(zip(found, self._parameters, strict=True)):
            if each is None:
                raise ValueError(
                    f"parameter {position} of shape {tuple(parameter.shape)} has no part in the objective: "
                    "no gradient reaches it"
                )
        self._gradients: tuple[torch.Tensor, ...] = found
        gradient = _row(found)
        require_finite("the gradient of the objective", gradient)
        none = np.zeros((0, gradient.size))
        return CurvedSample(self.objective, gradient, self.constraints, none, self)

    def hessian_times(self, step: np.ndarray) -> np.ndarray:
        """Return the Hessian of the objective times a step of all parameters, (n,). Raises NoGradient without one."""
        chunks = torch.from_numpy(step).split([parameter.numel() for parameter in self._parameters])
        along = [
            (gradient, chunk.reshape(gradient.shape).to(gradient))
            for gradient, chunk in zip(self._gradients, chunks, strict=True)
            if gradient.requires_grad  # that of a linear objective does not
        ]
        found = (
            products([each for each, _ in along], self._parameters, [each for _, each in along])
            if along
            else ()
        )
        row = _row(
            [
                torch.zeros_like(parameter) if each is None else each
                for each, parameter in zip(found or [None] * len(chunks), self._parameters, strict=True)
            ]
        )
        require_finite("a product with the Hessian of the objective", row)
        return row

    model: Any = None  # made of products once: the graph cannot be used once the parameters were changed


def _row(tensors) -> np.ndarray:
    return torch.cat([each.detach().reshape(-1).double().cpu() for each in tensors]).numpy()
