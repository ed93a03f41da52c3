"""Results of a closure at one design with products of the objective's Hessian."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from ...solve.adjoint.autograd import products
from .sample import Sample, Trial, require_finite


@dataclass(frozen=True)
class CurvedSample(Sample):
    """The objective and its gradient at a design, and the graph from which products with the Hessian are taken."""

    products: CurvedTrial | None = None


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
