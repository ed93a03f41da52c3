"""Steps of a linear least-squares model within bounds and a trust region, as the Gauss-Newton method takes them:

    min |J s + r|^2 / 2,    lower <= s <= upper,    |s| <= radius

Its minimum is that of |J s + r|^2 + mu |s|^2 within the bounds (Levenberg-Marquardt), with mu >= 0 such that the step is as
long as the radius, or mu = 0 if it is shorter. J. J. More, The Levenberg-Marquardt algorithm: implementation and theory,
Lecture Notes in Mathematics 630 (1978). C. Kanzow, N. Yamashita, M. Fukushima, Levenberg-Marquardt methods with strong local
convergence properties ... with convex constraints, J. Comput. Appl. Math. 172 (2004).
"""

from __future__ import annotations

import numpy as np
import scipy

# Largest difference between the length of a step and the radius, relative to the radius [More 1978, section 5].
_CLOSE = 0.1
# Smallest damping that is tried, relative to an upper bound of it, while no lower bound is known [More 1978, (5.5)].
_SMALLEST = 1e-3
_DAMPINGS = 60  # dampings that are tried; their interval is halved (its logarithm) at each
# Singular values below this fraction [-] of the largest are round-off, since the entries of a Jacobian are exact to 1e-10; a
# step has no part along their vectors. Tested by test_sheet_without_weight_tells_the_ratio_only.
_SINGULAR = 1e-9
# Changes of the set of entries at a bound, after which scipy's slower method takes over. Tested by
# test_bounded_step_agrees_with_scipy.
_SETS = 30


class DenseModel:
    """A linear model of residuals (m,), with their Jacobian (m, n) as a matrix."""

    def __init__(self, jacobian: np.ndarray, residuals: np.ndarray):
        if len(jacobian) > jacobian.shape[1]:
            basis, jacobian = np.linalg.qr(jacobian)
            residuals = basis.T @ residuals
        self._jacobian, self._residuals = jacobian, residuals
        self._at_low, self._at_high = np.zeros((2, jacobian.shape[1]), bool)  # at a bound in the last minimum
        self._factored: tuple[np.ndarray, tuple[np.ndarray, ...]] | None = (
            None  # of the last set of free entries
        )

    def decrease(self, step: np.ndarray) -> float:
        change = self._jacobian @ step
        return -float(change @ (self._residuals + 0.5 * change))

    def step(self, lower: np.ndarray, upper: np.ndarray, radius: float) -> np.ndarray:
        step = self.bounded(0.0, lower, upper)
        if not np.linalg.norm(step) <= radius:
            low, high = 0.0, float(np.linalg.norm(self._jacobian.T @ self._residuals)) / radius
            for _ in range(_DAMPINGS):
                damping = np.sqrt(max(low, _SMALLEST * high) * high)
                step = self.bounded(damping, lower, upper)
                length = np.linalg.norm(step)
                if abs(length - radius) <= _CLOSE * radius:
                    break
                low, high = (damping, high) if length > radius else (low, damping)
        return shortened(step, radius)

    def bounded(self, damping: float, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
        """Return the minimum of |J s + r|^2 + damping |s|^2 within the bounds; the shortest one if there are several.

        Entries at a bound are found by a primal-dual active set. M. Hintermuller, K. Ito, K. Kunisch, SIAM J. Optim. 13
        (2002).
        """
        low, high = self._at_low, self._at_high
        for _ in range(_SETS):
            free = ~(low | high)
            step = np.where(low, lower, np.where(high, upper, 0.0))
            rest = self._residuals + self._jacobian @ step
            step[free] = self._shortest(free, rest, damping)
            descent = -(self._jacobian.T @ (self._residuals + self._jacobian @ step) + damping * step)
            is_low = np.where(free, step < lower, low & (descent < 0.0))
            is_high = np.where(free, step > upper, high & (descent > 0.0))
            if (is_low == low).all() and (is_high == high).all():
                self._at_low, self._at_high = low, high
                return step
            low, high = is_low, is_high
        count = lower.size
        matrix = np.vstack([self._jacobian, np.sqrt(damping) * np.eye(count)])
        target = -np.concatenate([self._residuals, np.zeros(count)])
        return scipy.optimize.lsq_linear(matrix, target, (lower, upper), method="bvls").x

    def _shortest(self, free: np.ndarray, rest: np.ndarray, damping: float) -> np.ndarray:
        """Return the shortest minimum of |J s + rest|^2 + damping |s|^2 over the free entries."""
        if self._factored is None or not np.array_equal(self._factored[0], free):
            self._factored = free, np.linalg.svd(self._jacobian[:, free], full_matrices=False)
        left, sizes, right = self._factored[1]
        known = sizes > _SINGULAR * sizes.max(initial=0.0)
        sizes = sizes[known]
        return -right[known].T @ ((sizes / (sizes**2 + damping)) * (left[:, known].T @ rest))


def shortened(step: np.ndarray, radius: float) -> np.ndarray:
    """Return a step, scaled to the radius if it is longer."""
    length = float(np.linalg.norm(step))
    return step * (radius / length) if length > radius else step
