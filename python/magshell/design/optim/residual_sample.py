"""Results of a closure that returns residuals: their values at one design, and their Jacobian or products with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ...errors import NoGradient
from ...solve.adjoint.autograd import products
from .sample import Sample, require_finite


@dataclass(frozen=True)
class ResidualSample(Sample):
    """Residuals r (m,) at a design, with the objective |r|^2 / 2 and its gradient.

    slopes: the Jacobian of the residuals, (m, n), or (0, n) if only products with it are taken: then `products` has them.
    """

    residuals: np.ndarray
    slopes: np.ndarray
    products: ResidualTrial | None = None


class ResidualTrial:
    """The residuals of a closure, with the graph for their derivatives.

    closure: returns the residuals, a tensor (m,), or (residuals, None). jacobian: "forward", "backward", "products" or
    "auto", as in GaussNewton. Raises TypeError or ValueError for anything else and FloatingPointError for a value that is
    not finite.
    """

    def __init__(self, closure: Callable[..., Any], parameters: list[torch.Tensor], jacobian: str):
        with torch.enable_grad():
            result = closure()
        residuals, constraints = result if isinstance(result, tuple) and len(result) == 2 else (result, None)
        if constraints is not None:
            raise ValueError(
                "GaussNewton has bounds but no other constraints: use MMA or GCMMA, or add what breaks them as residuals"
            )
        self._residuals, self._parameters, self._how = _checked_residuals(residuals), parameters, jacobian
        self.values: np.ndarray = self._residuals.detach().double().cpu().numpy().copy()
        require_finite("the residuals", self.values)
        self.objective: float = 0.5 * float(self.values @ self.values)
        require_finite("the sum of squared residuals", np.array([self.objective]))
        self.constraints: np.ndarray = np.zeros(0)

    def differentiate(self) -> ResidualSample:
        """Return the sample with its derivatives.

        Raises ValueError if the residuals do not depend on the parameters, or a parameter affects none of them.
        """
        gradient = self._gradient()
        count = gradient.size
        if self.takes_products:
            empty = np.zeros((0, count))
            return ResidualSample(self.objective, gradient, np.zeros(0), empty, self.values, empty, self)
        slopes = self.matrix()
        require_finite("the Jacobian of the residuals", slopes)
        empty = np.zeros(0), np.zeros((0, count))
        return ResidualSample(self.objective, gradient, *empty, self.values, slopes)

    @property
    def takes_products(self) -> bool:
        """Return whether the Jacobian is not computed as a matrix."""
        count = sum(parameter.numel() for parameter in self._parameters)
        smaller, larger = sorted((self.values.size, count))
        costly = smaller > MOST_BACK_SUBSTITUTIONS or smaller**2 * larger > MOST_OPERATIONS
        return self._how == "products" or (self._how == "auto" and costly)

    def times(self, step: np.ndarray) -> np.ndarray:
        """Return the Jacobian times a step of all parameters, (m,)."""
        chunks = torch.from_numpy(step).split([parameter.numel() for parameter in self._parameters])
        tangents = [
            chunk.reshape(parameter.shape).to(parameter)
            for chunk, parameter in zip(chunks, self._parameters, strict=True)
        ]
        return self._tangent(tangents).detach().double().cpu().numpy()

    def transposed_times(self, weights: np.ndarray) -> np.ndarray:
        """Return the transposed Jacobian times weights of the residuals, (n,)."""
        given = torch.from_numpy(weights).to(self._residuals)
        found = products([self._residuals], self._parameters, [given])
        return self._row(found)

    def _gradient(self) -> np.ndarray:
        """Return the gradient of the objective, (n,)."""
        if not self._residuals.requires_grad:
            raise ValueError("the residuals do not depend on the parameters: no gradient reaches them")
        found = products([self._residuals], self._parameters, [self._residuals.detach()])
        for position, (each, parameter) in enumerate(zip(found, self._parameters, strict=True)):
            if each is None:
                raise ValueError(
                    f"parameter {position} of shape {tuple(parameter.shape)} has no part in the residuals: "
                    "no gradient reaches it"
                )
        row = self._row(found)
        require_finite("the gradient of the objective", row)
        return row

    def matrix(self) -> np.ndarray:
        """Return the Jacobian (m, n), by rows or by columns, whichever cost less."""
        n_parameters = sum(parameter.numel() for parameter in self._parameters)
        if self._how == "forward" or (
            self._how == "auto" and COST_OF_TANGENTS * n_parameters < self.values.size
        ):
            try:
                return self._by_columns(n_parameters)
            # Rows serve where a solve has no tangents (NoGradient), or an operator of torch no second derivative, for
            # which torch raises NotImplementedError.
            except (NoGradient, NotImplementedError):
                if self._how == "forward":
                    raise
        return self._by_rows()

    def _by_rows(self) -> np.ndarray:
        rows = np.eye(self.values.size)
        return np.stack([self.transposed_times(row) for row in rows])

    def _by_columns(self, count: int) -> np.ndarray:
        return np.stack([self.times(column) for column in np.eye(count)], axis=1)

    def _tangent(self, tangents: list[torch.Tensor]) -> torch.Tensor:
        """Return the Jacobian times tangents: the derivative of the transposed product, which is linear in its weights."""
        if self._transposed is None:
            weights = torch.zeros_like(self._residuals, requires_grad=True)
            with torch.enable_grad():
                rows = products([self._residuals], self._parameters, [weights], differentiable=True)
            self._transposed = weights, rows
        weights, rows = self._transposed
        used = [(row, tangent) for row, tangent in zip(rows, tangents, strict=True) if row is not None]
        return products([row for row, _ in used], [weights], [tangent for _, tangent in used])[0]

    _transposed: tuple[torch.Tensor, tuple[torch.Tensor, ...]] | None = None  # weights, and their products
    model: Any = None  # made of products once: the graph cannot be used once the parameters were changed

    def _row(self, found) -> np.ndarray:
        entries = zip(found, self._parameters, strict=True)
        chosen = [torch.zeros_like(parameter) if each is None else each for each, parameter in entries]
        return torch.cat([each.reshape(-1).double().cpu() for each in chosen]).numpy()


# Back-substitutions up to which a Jacobian is computed as a matrix. Conjugate gradients take about a hundred a step, each of
# which costs two. Tested by test_many_residuals_of_many_parameters_take_products.
MOST_BACK_SUBSTITUTIONS = 2000

# Multiplications of one factorization of a Jacobian (m, n), min(m, n)^2 max(m, n), up to which it is computed as a matrix: a
# step within bounds takes twenty to fifty. Tested by the same.
MOST_OPERATIONS = 2e9

# Cost of a column of a Jacobian over that of a row (1): a tangent of an equilibrium takes more evaluations than a gradient.
# Tested by test_few_parameters_of_many_residuals_take_columns.
COST_OF_TANGENTS = 3


def _checked_residuals(residuals) -> torch.Tensor:
    if not isinstance(residuals, torch.Tensor):
        raise TypeError(
            f"the residuals must be a tensor of shape (m,), got {type(residuals).__name__}: GaussNewton minimizes half of "
            "the sum of their squares"
        )
    if residuals.ndim != 1 or not residuals.is_floating_point() or len(residuals) == 0:
        raise ValueError(
            f"the residuals must be real numbers of shape (m,), m >= 1, got shape {tuple(residuals.shape)} and dtype "
            f"{residuals.dtype}: return them all, .reshape(-1), not the sum of their squares"
        )
    return residuals
