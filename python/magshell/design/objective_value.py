"""Return value of an objective: its number, named terms, constraints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .._input.quantity import real_numbers
from .._input.tensors import detached, is_tensor, require_torch


@dataclass(frozen=True)
class Answer:
    """The parts of an objective's return value.

    objective: as it was returned, or the sum of its terms. terms: numbers to record. constraints: (m,) or None.
    """

    objective: Any
    terms: dict[str, float]
    constraints: Any

    @staticmethod
    def of(result: Any) -> Answer:
        """Split a returned scalar, dict of terms, or tuple with constraints. Raises TypeError or ValueError on
        anything else."""
        head, *rest = result if isinstance(result, tuple) else (result,)
        terms, constraints = {}, None
        if isinstance(head, dict):
            if not head:
                raise ValueError("the objective returned no terms")
            terms, head = head, sum(head.values())
        for part in rest:
            if isinstance(part, dict):
                terms = {**terms, **part}
            elif is_tensor(part) and constraints is None:
                constraints = part
            else:
                raise TypeError(
                    "besides its value an objective returns a dict of terms and a tensor of constraints, "
                    f"one of each at most, got {type(part).__name__}"
                )
        return Answer(head, {name: _number(name, value) for name, value in terms.items()}, constraints)

    @staticmethod
    def of_residuals(result: Any) -> Answer:
        """Split returned residuals: a tensor (m,), or a dict of several, which are joined; and a dict of terms to record.

        The terms of a dict of residuals are half of their sums of squares. Raises TypeError or ValueError.
        """
        head, *rest = result if isinstance(result, tuple) else (result,)
        terms: dict[str, Any] = {}
        if isinstance(head, dict):
            for name, each in head.items():
                if not (is_tensor(each) and each.ndim == 1):
                    came = f"shape {tuple(each.shape)}" if is_tensor(each) else type(each).__name__
                    raise ValueError(f"the residuals {name!r} must be a tensor of shape (m,), got {came}")
            if not head:
                raise ValueError("the objective returned no residuals")
            terms = {name: 0.5 * (each.detach() ** 2).sum() for name, each in head.items()}
            head = require_torch("residuals").cat(list(head.values()))
        for part in rest:
            if not isinstance(part, dict):
                raise TypeError(
                    "besides its residuals an objective of GaussNewton returns a dict of terms to record, got "
                    f"{type(part).__name__}"
                )
            terms = {**terms, **part}
        return Answer(head, {name: _number(name, value) for name, value in terms.items()}, None)


def _number(name: str, value) -> float:
    try:
        return float(real_numbers(name, detached(value)))
    except (TypeError, ValueError):
        came = f"shape {tuple(value.shape)}" if is_tensor(value) else type(value).__name__
        raise ValueError(f"the term {name!r} must be a number or a scalar tensor, got {came}") from None
