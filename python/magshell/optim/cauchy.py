"""The quadratic model of L-BFGS-B within the box: its generalized Cauchy point, its minimum over the free entries.

Byrd, Lu, Nocedal, Zhu, SIAM J. Sci. Comput. 16 (1995), sections 4 and 5.
"""

from __future__ import annotations

import numpy as np

from .curvature import Curvature


def cauchy_step(gradient: np.ndarray, lower: np.ndarray, upper: np.ndarray, model: Curvature) -> np.ndarray:
    """The step (n,) to the first minimum of the model along the projected path -t gradient.

    lower <= 0 <= upper: of steps. On the path an entry i stops at its breakpoint t_i. With the entries sorted by it,
    the path's direction d, W^T d and W^T z change by one entry a breakpoint, so that the model's slope on every
    stretch is a running sum:

        f' = -|d|^2 (1 - theta t) - (W^T d) . M (W^T z),     f'' = theta |d|^2 - (W^T d) . M (W^T d)
    """
    bound = np.where(gradient < 0, upper, lower)
    with np.errstate(divide="ignore", invalid="ignore"):
        breakpoints = np.where(gradient != 0, -bound / gradient, 0.0)
    order = np.argsort(breakpoints, kind="stable")
    times = np.concatenate([[0.0], breakpoints[order]])  # of the stretches' beginnings; (n + 1,)

    # Sums over the entries that still move, from the last to stop backwards: no cancellation near the end.
    squares = _tail_sums(gradient[order] ** 2)
    w_d = -_tail_sums(gradient[order][:, None] * model.w[order])
    ends = np.append(times[1:], np.inf)
    with np.errstate(invalid="ignore"):  # stretches between entries that never stop have no length
        lengths = np.where(np.isfinite(times), np.diff(np.append(times, np.inf)), np.inf)
    advance = np.where(np.isfinite(ends)[:, None], lengths[:, None], 0.0) * w_d
    w_z = np.concatenate([np.zeros((1, w_d.shape[1])), np.cumsum(advance, axis=0)[:-1]])

    started = np.where(np.isfinite(times), times, 0.0)
    slope = -squares * (1 - model.theta * started) - np.einsum("ij,ij->i", w_d @ model.m, w_z)
    curvature = model.theta * squares - np.einsum("ij,ij->i", w_d @ model.m, w_d)
    with np.errstate(divide="ignore", invalid="ignore"):
        further = np.where(slope < 0, -slope / curvature, 0.0)
    stops = (further < lengths) | ~(squares > 0)
    stretch = int(stops.argmax())
    time = times[stretch] + (further[stretch] if squares[stretch] > 0 else 0.0)
    reached = np.clip(-min(time, np.finfo(float).max) * gradient, lower, upper)
    return np.where((breakpoints <= time) & (gradient != 0), bound, reached)


def subspace_step(
    gradient: np.ndarray, lower: np.ndarray, upper: np.ndarray, model: Curvature, cauchy: np.ndarray
) -> np.ndarray:
    """The step (n,) that minimizes the model over the entries which the Cauchy step leaves free, brought back into
    the box."""
    free = (cauchy > lower) & (cauchy < upper)
    if not free.any() or model.w.shape[1] == 0:
        return cauchy
    further = -model.solve_free((gradient + model.times(cauchy))[free], free)
    step = cauchy.copy()
    step[free] = np.clip(cauchy[free] + further, lower[free], upper[free])
    if gradient @ step < 0:
        return step
    # The projection may point uphill (Morales and Nocedal 2011); a shortened step cannot.
    room = np.where(further > 0, upper[free] - cauchy[free], lower[free] - cauchy[free])
    with np.errstate(divide="ignore", invalid="ignore"):
        length = min(1.0, np.where(further != 0, room / further, np.inf).min())
    step[free] = np.clip(cauchy[free] + length * further, lower[free], upper[free])
    return step


def _tail_sums(rows: np.ndarray) -> np.ndarray:
    """(k + 1, ...): the sum of rows i, i + 1, ... for each i, zero at the end."""
    zero = np.zeros((1, *rows.shape[1:]))
    return np.concatenate([np.cumsum(rows[::-1], axis=0)[::-1], zero])
