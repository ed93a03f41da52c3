"""Results of a closure at one design: objective and constraints, and their gradients on request."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch


@dataclass(frozen=True)
class Sample:
    """The objective and the constraints at a design, with gradients.

    objective: a number. gradient: (n,). constraints g <= 0: (m,). jacobian: (m, n). All float64.
    """

    objective: float
    gradient: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray

    @property
    def violation(self) -> float:
        """The largest positive constraint, 0 if all are satisfied."""
        return float(self.constraints.max(initial=0.0))


class Trial:
    """The values of a closure, with the graph for their gradients.

    closure: returns the objective, a scalar tensor, or (objective, constraints), with constraints (m,) <= 0.
    Raises TypeError or ValueError for anything else and FloatingPointError for a value that is not finite.
    """

    def __init__(self, closure: Callable[..., Any], parameters: list[torch.Tensor]):
        with torch.enable_grad():
            result = closure()
        objective, constraints = result if isinstance(result, tuple) and len(result) == 2 else (result, None)
        self._parameters = parameters
        self._objective = _checked_objective(objective)
        self._constraints = _checked_constraints(constraints)
        self.objective: float = float(self._objective.detach())
        self.constraints = np.zeros(0)
        if self._constraints is not None:
            self.constraints: Any = self._constraints.detach().double().cpu().numpy().copy()
        require_finite("the objective", np.array([self.objective]))
        require_finite("the constraints", self.constraints)

    def differentiate(self) -> Sample:
        """Return the sample with gradients. The parameters' `.grad` is then that of the objective; after an error, as
        before.

        Raises ValueError if the objective or a constraint does not depend on the parameters, or a parameter
        affects none of them.
        """
        before = [parameter.grad for parameter in self._parameters]
        reached = [False] * len(self._parameters)
        try:
            rows = [
                self._row(self._objective, "the objective", reached, retain=self._constraints is not None)
            ]
            gradients = [parameter.grad for parameter in self._parameters]
            if self._constraints is not None:
                last = len(self._constraints) - 1
                for i, constraint in enumerate(self._constraints):
                    rows.append(self._row(constraint, f"constraint {i}", reached, retain=i < last))
            if not all(reached):
                position = reached.index(False)
                raise ValueError(
                    f"parameter {position} of shape {tuple(self._parameters[position].shape)} has no part in the "
                    "objective or the constraints: no gradient reaches it"
                )
        except BaseException:
            self._leave(before)
            raise
        self._leave(gradients)
        return Sample(self.objective, rows[0], self.constraints, np.array(rows[1:]).reshape(-1, rows[0].size))

    def _row(self, value: torch.Tensor, label: str, reached: list[bool], retain: bool) -> np.ndarray:
        """Return one gradient, (n,), and mark the parameters that it reaches."""
        self._leave([None] * len(self._parameters))
        if value.requires_grad:
            value.backward(retain_graph=retain, inputs=self._parameters)
        if all(parameter.grad is None for parameter in self._parameters):
            raise ValueError(f"{label} does not depend on the parameters: no gradient reaches them")
        for position, parameter in enumerate(self._parameters):
            reached[position] |= parameter.grad is not None
        row = torch.cat(
            [
                (p.grad if p.grad is not None else torch.zeros_like(p)).reshape(-1).double().cpu()
                for p in self._parameters
            ]
        )
        require_finite(f"the gradient of {label}", row.numpy())
        return row.numpy()

    def _leave(self, gradients: list[Any]) -> None:
        """Set the parameters' `.grad`."""
        for parameter, gradient in zip(self._parameters, gradients, strict=True):
            parameter.grad = gradient


def _checked_objective(objective) -> torch.Tensor:
    if not isinstance(objective, torch.Tensor):
        raise TypeError(
            "the closure must return the objective, a scalar tensor, or (objective, constraints), "
            f"got {type(objective).__name__}"
        )
    if objective.ndim != 0 or not objective.is_floating_point():
        raise ValueError(
            f"the objective must be a real scalar, "
            f"got shape {tuple(objective.shape)} and dtype {objective.dtype}: "
            "sum it, or take its mean"
        )
    return objective


def _checked_constraints(constraints) -> torch.Tensor | None:
    if constraints is None:
        return None
    if (
        not isinstance(constraints, torch.Tensor)
        or constraints.ndim != 1
        or not constraints.is_floating_point()
    ):
        came = (
            tuple(constraints.shape) if isinstance(constraints, torch.Tensor) else type(constraints).__name__
        )
        raise ValueError(
            f"the constraints must be a tensor of shape (m,), each entry <= 0 if satisfied, got {came}"
        )
    return constraints if len(constraints) else None


def require_finite(label: str, values: np.ndarray) -> None:
    """Raise FloatingPointError if a number is not finite. label: what the numbers are."""
    bad = ~np.isfinite(values)
    if bad.any():
        entry = int(bad.argmax())
        where = f" (entry {entry} of {values.size})" if values.size > 1 else ""
        raise FloatingPointError(
            f"{label} is {values[entry]}{where}; the parameters are left where they were"
        )


STAGNATION = "the optimizer finds no lower design, to rounding"
