"""MMA's convex approximations of objective and constraints around a design, between two asymptotes a variable.

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

# Of an asymptote, in sizes. Svanberg's notes keep 0.01: MMA then swings about a minimum inside the box for ever.
_CLOSEST, _FARTHEST = 1e-6, 10.0
_GAP = 0.9  # of the way to an asymptote that a step may go


@dataclass(frozen=True)
class Asymptotes:
    """Options of the asymptotes, (n,) each: first distance in sizes, and factors after an oscillation or progress."""

    initial: np.ndarray
    shrink: np.ndarray
    grow: np.ndarray

    def distance(self, last: np.ndarray, step: np.ndarray, step_before: np.ndarray) -> np.ndarray:
        """Distances s, (n,): drawn in where the last two steps differ in sign, pushed out where they agree."""
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
        """(1 + m,) approximate values at the step t; each term as its difference from t = 0, to keep small steps."""
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


@dataclass(frozen=True)
class Surroundings:
    """All that approximations around a design are made of; slopes, distances and steps t in units of scale.

    values: (1 + m,). slopes g: (1 + m, n), over the free entries. sizes: (1 + m,) what a large slope of each function
    is. distance s, scale: (n,). lower, upper: (n,) the interval of t.
    """

    values: np.ndarray
    slopes: np.ndarray
    sizes: np.ndarray
    distance: np.ndarray
    scale: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @staticmethod
    def of(
        sample: Sample, box: Box, x: np.ndarray, distance: np.ndarray, move: np.ndarray, steepest: float
    ) -> Surroundings:
        """steepest: slope of the objective in the designs before, for at a minimum its own vanishes.

        A step stays in the box, short of the asymptotes, and no longer than move.
        """
        free = box.free
        scale, distance = box.scale[free], distance[free]
        slopes = np.vstack([sample.gradient, sample.jacobian])[:, free] * scale
        sizes = np.abs(slopes).max(axis=1, initial=0.0)
        sizes[0] = max(sizes[0], steepest)
        reach = np.minimum(_GAP * distance, move[free])
        lower = np.maximum((box.lower - x)[free] / scale, -reach)
        upper = np.minimum((box.upper - x)[free] / scale, reach)
        values = np.concatenate([[sample.objective], sample.constraints])
        return Surroundings(values, slopes, np.where(sizes > 0, sizes, 1.0), distance, scale, lower, upper)

    @property
    def size(self) -> float:
        """The objective's steepest slope, here or in the designs before."""
        return float(self.sizes[0])

    def step(self, convexity: np.ndarray, penalty: float) -> tuple[Approximation, np.ndarray]:
        """The approximations with the convexities rho, (1 + m,), and the step t that is best for them."""
        approximation = Approximation.of(self.values, self.slopes, self.distance, convexity)
        sizes = np.maximum(self.sizes, convexity)
        return approximation, approximation.subproblem(self.lower, self.upper, sizes, penalty).solve()
