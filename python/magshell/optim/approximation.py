"""MMA's convex approximations of objective and constraints around a design, between two asymptotes a
variable.

Written in steps t = (x' - x) / scale, with asymptotes at -s and s:

    f~(t) = f(x) + sum_j p_j / (s_j - t_j) + q_j / (s_j + t_j) - (p_j + q_j) / s_j
    p_j = s_j^2 (1.001 [g_j]+ + 0.001 [g_j]- + rho),    q_j = s_j^2 (0.001 [g_j]+ + 1.001 [g_j]- + rho)

g is the gradient in units of the sizes, rho >= 0 a convexity of its own for each function.
K. Svanberg, A class of globally convergent optimization methods ..., SIAM J. Optim. 12 (2002), (4.4)-(4.7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .box import Box
from .sample import Sample
from .subproblem import Subproblem

# Of an asymptote, in sizes. Svanberg's notes keep 0.01: MMA then swings about
# a minimum inside the box for ever.
_CLOSEST, _FARTHEST = 1e-6, 10.0
_GAP = 0.9  # of the way to an asymptote that a step may go


@dataclass(frozen=True)
class Asymptotes:
    """Options of the asymptotes, (n,) each: first distance in sizes, and factors after an oscillation or
    progress."""

    initial: np.ndarray
    shrink: np.ndarray
    grow: np.ndarray

    def distance(
        self, last: np.ndarray | None, step: np.ndarray | None, step_before: np.ndarray | None
    ) -> np.ndarray:
        """Distances s, (n,): drawn in where the last two steps differ in sign, pushed out where they
        agree."""
        if step_before is None:
            return self.initial.copy()
        agreement = step * step_before
        factor = np.where(agreement > 0, self.grow, np.where(agreement < 0, self.shrink, 1.0))
        return np.clip(factor * last, _CLOSEST, _FARTHEST)


@dataclass(frozen=True)
class Approximation:
    """values: (1 + m,), the objective first. p, q: (1 + m, n) over the free entries. distance s: (n,)."""

    values: np.ndarray
    p: np.ndarray
    q: np.ndarray
    distance: np.ndarray

    @staticmethod
    def of(
        values: np.ndarray, slopes: np.ndarray, distance: np.ndarray, convexity: np.ndarray
    ) -> Approximation:
        """slopes g: (1 + m, n). convexity rho: (1 + m,)."""
        up, down = np.maximum(slopes, 0.0), np.maximum(-slopes, 0.0)
        p = distance**2 * (1.001 * up + 0.001 * down + convexity[:, None])
        q = distance**2 * (0.001 * up + 1.001 * down + convexity[:, None])
        return Approximation(values, p, q, distance)

    def at(self, t: np.ndarray) -> np.ndarray:
        """(1 + m,) approximate values at the step t; each term as its difference from t = 0, to keep small
        steps."""
        return (
            self.values
            + self.p @ (t / (self.distance * (self.distance - t)))
            - self.q @ (t / (self.distance * (self.distance + t)))
        )

    def subproblem(
        self, lower: np.ndarray, upper: np.ndarray, sizes: np.ndarray, penalty: float
    ) -> Subproblem:
        """The subproblem with each function in units of its size, (1 + m,), and steps within the bounds."""
        p, q = self.p / sizes[:, None], self.q / sizes[:, None]
        limits = ((p + q) @ (1 / self.distance))[1:] - self.values[1:] / sizes[1:]
        return Subproblem(p, q, limits, self.distance, lower, upper, penalty)


def stacked(sample: Sample, scale: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (1 + m,) and slopes (1 + m, n free) in units of the sizes."""
    slopes = np.vstack([sample.gradient, sample.jacobian])[:, free] * scale[free]
    return np.concatenate([[sample.objective], sample.constraints]), slopes


def step_bounds(x: np.ndarray, box: Box, free: np.ndarray, distance: np.ndarray, move: np.ndarray):
    """The interval of t: inside the box, short of the asymptotes, no longer than move."""
    scale, reach = box.scale[free], np.minimum(_GAP * distance, move)
    lower = np.maximum((box.lower - x)[free] / scale, -reach)
    upper = np.minimum((box.upper - x)[free] / scale, reach)
    return lower, upper
