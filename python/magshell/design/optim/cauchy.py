"""Finds the Cauchy point of a bounded quadratic model with the Hessian of limited-memory BFGS."""

from __future__ import annotations

import numpy as np

_LEAST_CURVATURE = np.finfo(float).eps  # [-] smallest s.y / y.y of a pair that is used
_FLATTEST = 1e-8  # [-] smallest entry of a diagonal, relative to the largest


class Curvature:
    """The Hessian B of limited-memory BFGS in compact form, B = theta I - W M W^T.

    steps, changes: (k, n), oldest first. Without any, B = theta I.
    """

    def __init__(self, steps: np.ndarray, changes: np.ndarray, theta: float):
        self.theta = theta
        self.w: np.ndarray = np.concatenate([changes, theta * steps]).T  # (n, 2 k)
        inner = steps @ changes.T
        below = np.tril(inner, -1)
        inverse = np.block([[-np.diag(np.diag(inner)), below.T], [below, theta * steps @ steps.T]])
        self.m: np.ndarray = np.linalg.inv(inverse)

    def times(self, v: np.ndarray) -> np.ndarray:
        """Return the product B v."""
        return self.theta * v - self.w @ (self.m @ (self.w.T @ v))

    def solve_free(self, right: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Solve B_ff x = right over the free entries, (n free,). [BLNZ95] (5.11), by Sherman, Morrison and Woodbury."""
        w = self.w[free]
        small = np.eye(w.shape[1]) - self.m @ (w.T @ w) / self.theta
        return right / self.theta + w @ np.linalg.solve(small, self.m @ (w.T @ right)) / self.theta**2


def shows_curvature(step: np.ndarray, change: np.ndarray) -> bool:
    """Return whether the gradient's change along a step could be that of a convex function."""
    return bool(step @ change > _LEAST_CURVATURE * (change @ change))


def updated_diagonal(diagonal: np.ndarray | None, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the diagonal (n,) of the BFGS update of a diagonal matrix B, which is first scaled to the pair's size.

        B+ = r B - r (B s)^2 / s.B s + y^2 / s.y,    r = y.B^-1 y / s.y

    Without a diagonal, B is the unit matrix. The formula follows J. C. Gilbert and C. Lemarechal, Some numerical
    experiments with variable-storage quasi-Newton algorithms, Math. Programming 45 (1989).
    """
    old = np.ones_like(step) if diagonal is None else diagonal
    along = step @ change
    size = change @ (change / old) / along
    new = size * old - size * (old * step) ** 2 / (step @ (old * step)) + change**2 / along
    return np.maximum(new, _FLATTEST * new.max())


def cauchy_step(gradient: np.ndarray, lower: np.ndarray, upper: np.ndarray, model: Curvature) -> np.ndarray:
    """Return the step (n,) to the first minimum of the model along the projected path -t gradient.

    lower <= 0 <= upper: bounds of the step. On the path, entry i stops at its breakpoint t_i. With the entries sorted by
    breakpoint, the path's direction d, W^T d and W^T z change by one entry at each, so that the model's slope on every
    segment is a running sum:

        f' = -|d|^2 (1 - theta t) - (W^T d) . M (W^T z),     f'' = theta |d|^2 - (W^T d) . M (W^T d)
    """
    bound = np.where(gradient < 0, upper, lower)
    with np.errstate(divide="ignore", invalid="ignore"):
        breakpoints = np.where(gradient != 0, -bound / gradient, 0.0)
    order = np.argsort(breakpoints, kind="stable")
    times = np.concatenate([[0.0], breakpoints[order]])  # at the beginnings of the segments; (n + 1,)

    # Sums over the entries that still move, added from the last to stop backwards, to avoid cancellation near the end.
    squares = _tail_sums(gradient[order] ** 2)
    w_d = -_tail_sums(gradient[order][:, None] * model.w[order])
    ends = np.append(times[1:], np.inf)
    with np.errstate(invalid="ignore"):  # segments between entries that never stop have no length
        lengths = np.where(np.isfinite(times), np.diff(np.append(times, np.inf)), np.inf)
    advance = np.where(np.isfinite(ends)[:, None], lengths[:, None], 0.0) * w_d
    w_z = np.concatenate([np.zeros((1, w_d.shape[1])), np.cumsum(advance, axis=0)[:-1]])

    started = np.where(np.isfinite(times), times, 0.0)
    slope = -squares * (1 - model.theta * started) - np.einsum("ij,ij->i", w_d @ model.m, w_z)
    curvature = model.theta * squares - np.einsum("ij,ij->i", w_d @ model.m, w_d)
    with np.errstate(divide="ignore", invalid="ignore"):
        further = np.where(slope < 0, -slope / curvature, 0.0)
    stops = (further < lengths) | ~(squares > 0)
    segment = int(stops.argmax())
    time = times[segment] + (further[segment] if squares[segment] > 0 else 0.0)
    reached = np.clip(-min(time, np.finfo(float).max) * gradient, lower, upper)
    return np.where((breakpoints <= time) & (gradient != 0), bound, reached)


def subspace_step(
    gradient: np.ndarray, lower: np.ndarray, upper: np.ndarray, model: Curvature, cauchy: np.ndarray
) -> np.ndarray:
    """Return the step (n,) that minimizes the model over the entries that the Cauchy step leaves free, projected onto
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
    """Return the sums of rows i, i + 1, ... for each i, (k + 1, ...), zero at the end."""
    zero = np.zeros((1, *rows.shape[1:]))
    return np.concatenate([np.cumsum(rows[::-1], axis=0)[::-1], zero])
