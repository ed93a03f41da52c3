"""A linear model of residuals with its Jacobian as a matrix, and its minima within bounds and a trust region."""

from __future__ import annotations

from collections.abc import Callable

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
# Damping [-], relative to a bound of the largest eigenvalue of J^T J, from which on normal equations serve: they are solved
# to 1e-6 and better. Below, the singular values of J are computed.
_REGULAR = 1e-10
_SETS = 12  # changes of the set of entries at a bound, after which an interior-point method finds it
_POLISHED = 2  # the same changes after that
_ITERATIONS = 60  # of the interior-point method, which takes 10 to 30
_GAP = 1e-12  # [-] mean distance from a bound times its force at the end, over that at the start
_BOUNDARY = 0.995  # [-] share of the way to the nearest bound that an interior step takes at most


class DenseModel:
    """A linear model of residuals (m,), with their Jacobian (m, n) as a matrix."""

    def __init__(self, jacobian: np.ndarray, residuals: np.ndarray):
        if len(jacobian) > jacobian.shape[1]:
            basis, jacobian = np.linalg.qr(jacobian)
            residuals = basis.T @ residuals
        self._jacobian, self._residuals = jacobian, residuals
        self._wide = len(jacobian) < jacobian.shape[1]  # fewer residuals than entries
        self._products: np.ndarray = jacobian @ jacobian.T if self._wide else jacobian.T @ jacobian
        bound = np.abs(self._products).sum(axis=1).max(initial=0.0)  # of the largest eigenvalue
        self._regular = max(_REGULAR * float(bound), np.finfo(float).tiny)
        self._at_low, self._at_high = np.zeros((2, jacobian.shape[1]), bool)  # at a bound in the last minimum
        self._decomposed: tuple[np.ndarray, tuple[np.ndarray, ...]] | None = None  # of the last free entries

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

        Entries at a bound are found by a primal-dual active set. If that does not settle, as with many entries of nearly
        the same effect, an interior-point method finds them. M. Hintermuller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002);
        S. Mehrotra, SIAM J. Optim. 2 (1992).
        """
        takes_singular_values = (
            damping < self._regular
        )  # once, as they take as long as the interior-point method
        step = self._active_set(damping, lower, upper, 1 if takes_singular_values else _SETS)
        if step is None:
            found, self._at_low, self._at_high = interior_minimum(
                self._jacobian, self._residuals, max(damping, self._regular), lower, upper
            )
            at_low, at_high = self._at_low, self._at_high
            step = self._active_set(damping, lower, upper, _POLISHED)
            if step is None:
                inside = np.clip(found, lower, upper)
                step = np.where(at_low, lower, np.where(at_high, upper, inside))
        return step

    def _active_set(
        self, damping: float, lower: np.ndarray, upper: np.ndarray, sets: int
    ) -> np.ndarray | None:
        """Return the minimum if at most so many changes of the set of entries at a bound find it, else None."""
        low, high = self._at_low, self._at_high
        for _ in range(sets):
            free = ~(low | high)
            step = np.where(low, lower, np.where(high, upper, 0.0))
            rest = self._residuals + self._jacobian @ step
            step[free] = self._free_minimum(free, rest, damping)
            descent = -(self._jacobian.T @ (self._residuals + self._jacobian @ step) + damping * step)
            is_low = np.where(free, step < lower, low & (descent < 0.0))
            is_high = np.where(free, step > upper, high & (descent > 0.0))
            if (is_low == low).all() and (is_high == high).all():
                self._at_low, self._at_high = low, high
                return step
            low, high = is_low, is_high
        return None

    def _free_minimum(self, free: np.ndarray, rest: np.ndarray, damping: float) -> np.ndarray:
        """Return the shortest minimum of |J s + rest|^2 + damping |s|^2 over the free entries."""
        jacobian = self._jacobian[:, free]
        if damping < self._regular:
            return self._shortest(free, jacobian, rest, damping)
        if len(jacobian) < jacobian.shape[1]:
            held = self._jacobian[:, ~free]
            less = self._wide and held.size < jacobian.size
            products = self._products - held @ held.T if less else jacobian @ jacobian.T
            return -jacobian.T @ _solved(products, damping, rest)
        products = jacobian.T @ jacobian if self._wide else self._products[np.ix_(free, free)]
        return -_solved(products, damping, jacobian.T @ rest)

    def _shortest(
        self, free: np.ndarray, jacobian: np.ndarray, rest: np.ndarray, damping: float
    ) -> np.ndarray:
        if self._decomposed is None or not np.array_equal(self._decomposed[0], free):
            self._decomposed = free, np.linalg.svd(jacobian, full_matrices=False)
        left, sizes, right = self._decomposed[1]
        known = sizes > _SINGULAR * sizes.max(initial=0.0)
        sizes = sizes[known]
        return -right[known].T @ ((sizes / (sizes**2 + damping)) * (left[:, known].T @ rest))


def interior_minimum(
    jacobian: np.ndarray, residuals: np.ndarray, damping: float, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the minimum of |J s + r|^2 + damping |s|^2, lower < s < upper, and which entries are at either bound.

    By Mehrotra's predictor and corrector. damping: positive.
    """
    bounds, sides = np.stack([lower, upper]), np.array([[1.0], [-1.0]])
    bounded = np.isfinite(bounds)
    count, products = max(int(bounded.sum()), 1), _Products(jacobian)
    step = _inside(lower, upper)
    slope = jacobian.T @ (residuals + jacobian @ step) + damping * step
    smallest = float(np.finfo(float).tiny)
    force = np.where(
        bounded, max(float(np.abs(slope).mean()), smallest), 0.0
    )  # of the bounds, on the entries
    gap = np.where(bounded, sides * (step - bounds), np.inf)
    first = max(float((gap[bounded] * force[bounded]).sum()) / count, smallest)
    for _ in range(_ITERATIONS):
        slope = jacobian.T @ (residuals + jacobian @ step) + damping * step
        mean = float((gap[bounded] * force[bounded]).sum()) / count
        if mean <= _GAP * first:
            break
        inverse = 1.0 / gap
        solve = products.solver(damping + (force * inverse).sum(axis=0))

        def toward(target: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
            """Return the changes of the step and of the forces, to distances times forces of these sizes."""
            change = solve((sides * target * inverse).sum(axis=0) - slope)  # noqa: B023 - called in this turn
            return change, target * inverse - force - force * inverse * sides * change  # noqa: B023

        change, by_force = toward(0.0)
        fraction = _fraction(sides * change, gap, by_force, force)
        gap_then, force_then = gap + fraction * sides * change, force + fraction * by_force
        then = float((gap_then[bounded] * force_then[bounded]).sum()) / count
        centring = max(mean, smallest) * min(1.0, then / max(mean, smallest)) ** 3
        change, by_force = toward(np.where(bounded, centring - sides * change * by_force, 0.0))
        fraction = _BOUNDARY * _fraction(sides * change, gap, by_force, force)
        # Distances are added up, as their difference from the bounds would lose all digits.
        step, gap, force = (
            step + fraction * change,
            gap + fraction * sides * change,
            force + fraction * by_force,
        )
    # Without its bound an entry would pass it by more than its distance.
    curvature = (jacobian**2).sum(axis=0) + damping
    at = bounded & (gap * curvature < force)
    return step, at[0], at[1]


class _Products:
    """J^T J for solves with a diagonal added to it."""

    def __init__(self, jacobian: np.ndarray):
        self._jacobian = jacobian
        self._wide = len(jacobian) < jacobian.shape[1]
        self._products = None if self._wide else jacobian.T @ jacobian

    def solver(self, diagonal: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return the function that solves (J^T J + diag) x = b; diagonal: (n,), positive."""
        if self._products is not None:
            factor = scipy.linalg.cho_factor(self._products + np.diag(diagonal), check_finite=False)
            return lambda right: scipy.linalg.cho_solve(factor, right, check_finite=False)
        scaled = self._jacobian / diagonal
        factor = scipy.linalg.cho_factor(np.eye(len(scaled)) + scaled @ self._jacobian.T, check_finite=False)
        return lambda right: (
            right / diagonal - scaled.T @ scipy.linalg.cho_solve(factor, scaled @ right, check_finite=False)
        )


def _inside(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return a point away from the bounds, near zero."""
    margin = 0.1 * np.minimum(upper - lower, 10.0)
    return np.clip(0.0, lower + margin, upper - margin)


def _fraction(by_gap: np.ndarray, gap: np.ndarray, by_force: np.ndarray, force: np.ndarray) -> float:
    """Return the largest fraction of changes, up to 1, that leaves all gaps and forces positive."""
    falls, weakens = by_gap < 0.0, by_force < 0.0
    fractions = (gap[falls] / -by_gap[falls], force[weakens] / -by_force[weakens])
    return min(1.0, *(float(each.min(initial=np.inf)) for each in fractions))


def _solved(products: np.ndarray, damping: float, right: np.ndarray) -> np.ndarray:
    """Solve (P + damping I) x = right, P symmetric and positive semidefinite."""
    matrix = products + damping * np.eye(len(products))
    return scipy.linalg.cho_solve(
        scipy.linalg.cho_factor(matrix, check_finite=False), right, check_finite=False
    )


def shortened(step: np.ndarray, radius: float) -> np.ndarray:
    """Return a step, scaled to the radius if it is longer."""
    length = float(np.linalg.norm(step))
    return step * (radius / length) if length > radius else step
