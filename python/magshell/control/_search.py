"""What windows and horizons share: the search of some rows of a control, and the bounds of rows."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._checks.quantity import real_numbers
from .._checks.tensors import real_tensor, require_torch
from ..design.minimize import minimize
from ..design.minimum import Minimum
from ..errors import DesignRejected, ObjectiveFailed

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


def given_controls(controls):
    """(steps, ...), finite, a copy without history."""
    torch = require_torch("ms.control")
    now = real_tensor("controls", controls, ("...", "k")).detach().clone()
    if not torch.isfinite(now).all():
        raise ValueError("controls must be finite")
    return now


def row_bound(name: str, value: Any, controls):
    """Of every entry; infinite where there is none."""
    shape, array = tuple(controls.shape[1:]), real_numbers(name, value)
    if np.isnan(array).any():
        raise ValueError(f"{name} must be numbers, got nan")
    if array.shape not in ((), shape):
        raise ValueError(f"{name} must be a number or have the shape of a row, {shape}, got {array.shape}")
    return controls.new_tensor(np.broadcast_to(array, controls.shape).copy())


def check_functions(**functions: Any) -> None:
    for name, function in functions.items():
        if not callable(function):
            raise ValueError(f"{name} must be a function, got {function!r:.60}")


def search_rows(
    objective: Callable[..., Any],
    rows,
    lower: Numbers,
    upper: Numbers,
    make: Callable[..., Any] | None,
    **options: Any,
) -> tuple[Minimum | None, DesignRejected | None]:
    """The best rows, or None; and why a search ended early that met a design that cannot be evaluated.

    make: function (parameters, lower, upper) -> optimizer; None: ms.optim.LBFGS. options: of ms.minimize.
    """
    rows = rows.clone().requires_grad_()
    try:
        return minimize(objective, [rows], (make or _lbfgs)([rows], lower, upper), **options), None
    except ObjectiveFailed as error:
        if not isinstance(error.__cause__, DesignRejected):
            raise
        return error.last_good, error.__cause__
    except DesignRejected as error:
        return None, error


def _lbfgs(parameters, lower, upper):
    from ..optim import LBFGS

    return LBFGS(parameters, lower=lower, upper=upper, first_step=0.1, max_evaluations=5)
