"""MMA's convex approximations of objective and constraints around a design, between two asymptotes a variable.

Written in steps t = (x' - x) / scale, with asymptotes at -s and s:

    f~(t) = f(x) + sum_j p_j / (s_j - t_j) + q_j / (s_j + t_j) - (p_j + q_j) / s_j
    p_j = s_j^2 (1.001 [g_j]+ + 0.001 [g_j]- + rho),    q_j = s_j^2 (0.001 [g_j]+ + 1.001 [g_j]- + rho)

g is the gradient in units of the sizes, and rho >= 0 a convexity of each function.
K. Svanberg, A class of globally convergent optimization methods ..., SIAM J. Optim. 12 (2002), (4.4)-(4.7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .box import Box
from .sample import Sample
from .subproblem import Subproblem

# Smallest and largest distance of an asymptote, in sizes. Svanberg's notes take 0.01 as the smallest: MMA then oscillates
# about a minimum inside the box without end.
_CLOSEST, _FARTHEST = 1e-6, 10.0
_GAP = 0.9  # [-] largest step, as a fraction of the distance to an asymptote


@dataclass(frozen=True)
class Asymptotes:
    """Options of the asymptotes, (n,) each: first distance in sizes, and factors after an oscillation or progress."""

    initial: np.ndarray
    shrink: np.ndarray
    grow: np.ndarray

    def distance(self, last: np.ndarray, step: np.ndarray, step_before: np.ndarray) -> np.ndarray:
        """Return the distances s of the asymptotes, (n,): smaller if the last two steps differ in sign, larger if
        they agree."""
        agreement = step * step_before
        factor = np.where(agreement > 0, self.grow, np.where(agreement < 0, self.shrink, 1.0))
        return np.clip(factor * last, _CLOSEST, _FARTHEST)


@dataclass(frozen=True)
class Approximation:
    """Convex approximations of all functions around a design.

    values: (1 + m,), the objective first. p, q: (1 + m, n) over the free entries. distance s: (n,).
    """

    values: np.ndarray
    p: np.ndarray
    q: np.ndarray
    distance: np.ndarray

    @staticmethod
    def of(
        values: np.ndarray, slopes: np.ndarray, distance: np.ndarray, convexity: np.ndarray
    ) -> Approximation:
        """Compute p and q from the slopes g (1 + m, n) and the convexity rho (1 + m,)."""
        up, down = np.maximum(slopes, 0.0), np.maximum(-slopes, 0.0)
        p = distance**2 * (1.001 * up + 0.001 * down + convexity[:, None])
        q = distance**2 * (0.001 * up + 1.001 * down + convexity[:, None])
        return Approximation(values, p, q, distance)

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return the approximate values at the step t, (1 + m,).

        Each term is computed as its difference from t = 0, which is accurate for small steps.
        """
        return (
            self.values
            + self.p @ (t / (self.distance * (self.distance - t)))
            - self.q @ (t / (self.distance * (self.distance + t)))
        )

    def subproblem(
        self, lower: np.ndarray, upper: np.ndarray, sizes: np.ndarray, penalty: float
    ) -> Subproblem:
        """Return the subproblem with each function in units of its size, (1 + m,), and steps within the bounds."""
        p, q = self.p / sizes[:, None], self.q / sizes[:, None]
        limits = ((p + q) @ (1 / self.distance))[1:] - self.values[1:] / sizes[1:]
        return Subproblem(p, q, limits, self.distance, lower, upper, penalty)


@dataclass(frozen=True)
class ApproximationData:
    """The data from which approximations around a design are made. Slopes, distances and steps t are in units of scale.

    values: (1 + m,). slopes g: (1 + m, n), over the free entries. sizes: (1 + m,), the largest slope of each
    function. distance s, scale: (n,). lower, upper: (n,), the interval of t.
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
    ) -> ApproximationData:
        """Collect the data at a design x. The steps are limited to the box, to `move`, and by the asymptotes.

        steepest: slope of the objective in earlier designs, used because the slope vanishes at a minimum.
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
        return ApproximationData(
            values, slopes, np.where(sizes > 0, sizes, 1.0), distance, scale, lower, upper
        )

    @property
    def size(self) -> float:
        """The objective's steepest slope, here or in earlier designs."""
        return float(self.sizes[0])

    def step(self, convexity: np.ndarray, penalty: float) -> tuple[Approximation, np.ndarray]:
        """Return the approximations with the convexities rho (1 + m,), and the step t that solves their subproblem."""
        approximation = Approximation.of(self.values, self.slopes, self.distance, convexity)
        sizes = np.maximum(self.sizes, convexity)
        return approximation, approximation.subproblem(self.lower, self.upper, sizes, penalty).solve()
