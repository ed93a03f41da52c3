"""The convex separable subproblem of MMA, by a primal-dual interior point method, or by its dual if it has one constraint.

    minimize    sum_j p_0j / (s_j - t_j) + q_0j / (s_j + t_j)  +  sum_i c y_i + y_i^2 / 2
    such that   sum_j p_ij / (s_j - t_j) + q_ij / (s_j + t_j) - y_i <= b_i
                lower_j <= t_j <= upper_j,  y_i >= 0

K. Svanberg, MMA and GCMMA - two methods for nonlinear optimization (2007), sections 4 and 5, without the variable
z, which only min-max problems need, and with asymptotes at -s and s, as MMA's own rules place them. The variables t
are steps in units of the design variables' sizes, and the functions are scaled to unit slopes, so that the tolerances
below mean the same in every problem.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

_LAST_BARRIER = 1e-10
_SAME = 1e-14  # [-] relative precision of the multiplier of an only constraint
_NEWTON_LIMIT = 100  # Newton iterations for one barrier value, which takes 3 to 10


@dataclass(frozen=True)
class Subproblem:
    """The data of the subproblem.

    p, q: (1 + m, n) >= 0, the objective's row first. limits b: (m,). asymptote s, lower, upper: (n,). penalty c.
    """

    p: np.ndarray
    q: np.ndarray
    limits: np.ndarray
    asymptote: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    penalty: float

    def solve(self) -> np.ndarray:
        """Return the minimizer t, (n,)."""
        if len(self.limits) == 0:
            return self._at(np.zeros(0))
        return self._by_dual() if len(self.limits) == 1 else self._interior_point()

    def _at(self, multipliers: np.ndarray) -> np.ndarray:
        """Return the minimizer t at given multipliers of the constraints, (m,).

        It solves P / (s - t)^2 = Q / (s + t)^2 for each variable separately, clipped to its interval, with the sums P and Q
        of p and q over the functions.
        """
        weights = np.concatenate([[1.0], multipliers])
        root_p, root_q = np.sqrt(weights @ self.p), np.sqrt(weights @ self.q)
        return np.clip(self.asymptote * (root_q - root_p) / (root_q + root_p), self.lower, self.upper)

    def _by_dual(self) -> np.ndarray:
        """Return t at the multiplier of the only constraint at which this is met, by a search along a line.

        The excess of the constraint falls as its multiplier grows (Svanberg 1987, 4). A search takes some ten evaluations of
        t, the interior point method a hundred steps or more of several times the work.
        """

        def excess(multiplier: float) -> float:
            t = self._at(np.array([multiplier]))
            value = self.p[1] @ (1.0 / (self.asymptote - t)) + self.q[1] @ (1.0 / (self.asymptote + t))
            return float(value - max(multiplier - self.penalty, 0.0) - self.limits[0])

        if excess(0.0) <= 0.0:
            return self._at(np.zeros(1))
        high = 1.0
        while excess(high) > 0.0:
            high *= 8.0
        low = 0.125 * high if high > 1.0 else 0.0
        return self._at(np.array([scipy.optimize.brentq(excess, low, high, xtol=1e-300, rtol=_SAME)]))

    def _interior_point(self) -> np.ndarray:
        point = _Point.start(self)
        barrier = 1.0
        while barrier > _LAST_BARRIER:
            residual = point.residual(barrier)
            for _ in range(_NEWTON_LIMIT):
                if np.abs(residual).max() < 0.9 * barrier:
                    break
                moved = point.newton(barrier, np.linalg.norm(residual))
                if moved is None:  # the residual is round-off
                    break
                point, residual = moved
            barrier *= 0.1
        return point.t


@dataclass(frozen=True)
class _Point:
    """An iterate: primal t, y, slack s of the constraints, and the multipliers of constraints, of t's bounds and of
    y's."""

    of: Subproblem
    t: np.ndarray
    y: np.ndarray
    slack: np.ndarray
    multiplier: np.ndarray
    at_lower: np.ndarray
    at_upper: np.ndarray
    at_zero: np.ndarray

    @staticmethod
    def start(sub: Subproblem) -> _Point:
        m = len(sub.limits)
        t = 0.5 * (sub.lower + sub.upper)
        at_bound = np.maximum(1.0, 2.0 / (sub.upper - sub.lower))
        ones = np.ones(m)
        return _Point(sub, t, ones, ones, ones, at_bound, at_bound, np.full(m, max(1.0, 0.5 * sub.penalty)))

    def parts(self) -> tuple[np.ndarray, ...]:
        return self.t, self.y, self.slack, self.multiplier, self.at_lower, self.at_upper, self.at_zero

    @cached_property
    def slopes(self) -> np.ndarray:
        """The derivatives of objective and constraints, (1 + m, n)."""
        sub = self.of
        return sub.p / (sub.asymptote - self.t) ** 2 - sub.q / (sub.asymptote + self.t) ** 2

    @cached_property
    def excess(self) -> np.ndarray:
        """The constraints minus y and b, (m,)."""
        sub = self.of
        values = sub.p[1:] @ (1 / (sub.asymptote - self.t)) + sub.q[1:] @ (1 / (sub.asymptote + self.t))
        return values - self.y - sub.limits

    def residual(self, barrier: float) -> np.ndarray:
        """Return the residual of the perturbed optimality conditions."""
        sub, slopes = self.of, self.slopes
        return np.concatenate(
            [
                slopes[0] + self.multiplier @ slopes[1:] - self.at_lower + self.at_upper,
                sub.penalty + self.y - self.multiplier - self.at_zero,
                self.excess + self.slack,
                self.at_lower * (self.t - sub.lower) - barrier,
                self.at_upper * (sub.upper - self.t) - barrier,
                self.at_zero * self.y - barrier,
                self.multiplier * self.slack - barrier,
            ]
        )

    def newton(self, barrier: float, norm: float) -> tuple[_Point, np.ndarray] | None:
        """Take one damped Newton step; returns the point and its residual, or None if no step reduces the residual."""
        sub = self.of
        direction = self._direction(barrier)
        rates = [-step / value for step, value in zip(direction[1:], self.parts()[1:], strict=True)]
        rates += [-direction[0] / (self.t - sub.lower), direction[0] / (sub.upper - self.t)]
        length = 1.0 / max(1.0, *(1.01 * rate.max() for rate in rates))
        for _ in range(50):
            parts = zip(self.parts(), direction, strict=True)
            moved = _Point(sub, *(value + length * step for value, step in parts))
            inside = (moved.t > sub.lower).all() and (moved.t < sub.upper).all()
            if inside:
                residual = moved.residual(barrier)
                if np.linalg.norm(residual) < norm:
                    return moved, residual
            length *= 0.5
        return None

    def _direction(self, barrier: float) -> tuple[np.ndarray, ...]:
        """Return the Newton step, from a system of the m multipliers after elimination of all else."""
        sub = self.of
        above, below = self.t - sub.lower, sub.upper - self.t
        slopes = self.slopes
        jacobian = slopes[1:]
        weights = np.concatenate([[1.0], self.multiplier])
        to_upper, to_lower = sub.asymptote - self.t, sub.asymptote + self.t
        curvature = 2 * (weights @ sub.p) / (to_upper * to_upper * to_upper)
        curvature += 2 * (weights @ sub.q) / (to_lower * to_lower * to_lower)
        diagonal_t = curvature + self.at_lower / above + self.at_upper / below
        diagonal_y = 1.0 + self.at_zero / self.y
        force_t = slopes[0] + self.multiplier @ jacobian - barrier / above + barrier / below
        force_y = sub.penalty + self.y - self.multiplier - barrier / self.y
        force_multiplier = self.excess + barrier / self.multiplier

        matrix = (jacobian / diagonal_t) @ jacobian.T
        matrix += np.diag(1 / diagonal_y + self.slack / self.multiplier)
        right = force_multiplier - jacobian @ (force_t / diagonal_t) + force_y / diagonal_y
        multiplier = np.linalg.solve(matrix, right)
        t = -(force_t + multiplier @ jacobian) / diagonal_t
        y = (multiplier - force_y) / diagonal_y
        slack = barrier / self.multiplier - self.slack - self.slack / self.multiplier * multiplier
        at_lower = barrier / above - self.at_lower - self.at_lower / above * t
        at_upper = barrier / below - self.at_upper + self.at_upper / below * t
        at_zero = barrier / self.y - self.at_zero - self.at_zero / self.y * y
        return t, y, slack, multiplier, at_lower, at_upper, at_zero
