"""Fields in time as B-splines: smooth, local, and never outside the bounds of their control points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import count
from ..._input.quantity import quantity
from ..._input.tensors import detached, positive_number, require_torch
from ._arguments import tensor
from .signals import at_times

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def spline(
    times: Numbers, control_points: Numbers, duration: Numbers, degree: int = 3, periodic: bool = False
) -> torch.Tensor:
    """Return B(t) = sum_i N_i(t) P_i, T, with B-splines N_i of a degree on evenly spaced knots; C2 for cubic ones.

    The N_i are not negative and their sum is 1, so each component stays within the bounds of the control points', and
    |B| below the largest |P_i|: bounds of an optimizer on P hold for the field at all times. The spline begins at
    its first control point and ends at its last; a periodic one is smooth across its end.

    times: (n,) or one, s, within 0 ... duration; any if periodic. control_points: (k, 3) T, k > degree. duration: s.
    Differentiable in times, control points and duration.

    >>> points = torch.zeros(6, 3, dtype=torch.float64, requires_grad=True)  # doctest: +SKIP
    >>> field = ms.control.spline(ms.control.step_times(50, 1e-3), points, duration=0.05)  # doctest: +SKIP
    """
    control_points = tensor("control_points", "T", control_points, ("k", 3))
    return spline_weights(times, len(control_points), duration, degree, periodic) @ control_points


def spline_weights(
    times: Numbers, number: int, duration: Numbers, degree: int = 3, periodic: bool = False
) -> torch.Tensor:
    """Return the weights N_i(t) of the control points: (n, number), or (number,) at one time. Arguments as in
    `spline`."""
    torch = require_torch("ms.control.spline")
    degree = count("degree", degree)
    number = count("the number of control points", number, least=degree + 1)
    fractions = at_times(times) / positive_number("duration", "s", duration)
    if periodic:
        fractions = fractions - fractions.detach().floor()
        knots = (np.arange(number + 2 * degree + 1) - degree) / number
        basis = _basis(fractions, knots, degree)
        # The last basis functions are the first ones, one period later.
        wrapped = basis[..., :degree] + basis[..., number:]
        return torch.cat([wrapped, basis[..., degree:number]], dim=-1)
    _require_within(fractions.detach())
    inner = np.linspace(0, 1, number - degree + 1)
    return _basis(fractions, np.concatenate([np.zeros(degree), inner, np.ones(degree)]), degree)


def fit_spline(
    values: Any,
    times: Numbers,
    number: int,
    duration: Numbers,
    degree: int = 3,
    periodic: bool = False,
    limit: float | None = None,
) -> torch.Tensor:
    """Return the control points (number, 3) T of the spline that fits a series best, by least squares.

    values: (n, 3) T at times (n,) s. limit: T, that no component of a control point may exceed; by default none. Raises
    ValueError where the series does not determine them: too few values, or none in a part of the duration.
    The result is a start for an optimization; it has no gradient.

    number: how many control points. duration, degree, periodic: as in `spline`.

    >>> import magshell as ms
    >>> import numpy as np
    >>> times = np.linspace(0, 1, 20)
    >>> series = 1e-3 * np.stack([times, 0 * times, 0 * times], axis=1)
    >>> ms.control.fit_spline(series, times, number=5, duration=1.0).shape
    torch.Size([5, 3])
    """
    torch = require_torch("ms.control.fit_spline")
    times = quantity("times", "s", detached(times), ("n",))
    values = quantity("values", "T", detached(values), (len(times), 3))
    duration = float(quantity("duration", "s", detached(duration), ()))
    weights = spline_weights(times, number, duration, degree, periodic).numpy()
    rank = np.linalg.matrix_rank(weights, tol=1e-10)
    if rank < number:
        raise ValueError(
            f"{len(times)} values at these times determine {rank} of {number} control points: take fewer"
        )
    if limit is None:
        return torch.tensor(np.linalg.lstsq(weights, values, rcond=None)[0])
    from scipy.optimize import lsq_linear  # when needed, as loading it takes long

    bound = float(positive_number("limit", "T", limit))
    columns = [lsq_linear(weights, column / bound, (-1.0, 1.0), method="bvls").x for column in values.T]
    return torch.tensor(bound * np.stack(columns, axis=1))


def _basis(fractions, knots: np.ndarray, degree: int):  # plain-words: ok (B-splines have knots)
    """Evaluate all B-splines of the knots at fractions of the duration, 0 to 1, by the recursion of Cox and de Boor."""
    torch = require_torch("ms.control.spline")
    last = len(knots) - degree - 2
    span = np.clip(np.searchsorted(knots, fractions.detach().numpy(), side="right") - 1, degree, last)
    basis = torch.nn.functional.one_hot(torch.as_tensor(span), len(knots) - 1).to(fractions)
    knots = fractions.new_tensor(knots)
    for d in range(1, degree + 1):
        widths = knots[d:] - knots[:-d]
        inverse = torch.where(widths > 0, 1 / widths, 0.0)  # repeated knots: 0 / 0 counts as 0
        rising = (fractions[..., None] - knots[: -d - 1]) * inverse[:-1]
        falling = (knots[d + 1 :] - fractions[..., None]) * inverse[1:]
        basis = rising * basis[..., :-1] + falling * basis[..., 1:]
    return basis


def _require_within(fractions) -> None:
    """Raise ValueError unless all fractions of the duration are in 0 ... 1, to rounding."""
    if not fractions.numel():
        return
    rounding, low, high = 1e-9, float(fractions.min()), float(fractions.max())
    if not -rounding <= low <= high <= 1 + rounding:
        raise ValueError(f"times [s] must lie within 0 ... duration, got {low:g} ... {high:g} of it")
