"""Steps of a linear least-squares model from products with its Jacobian alone, for many residuals of many parameters.

A step goes to the Cauchy point, the first minimum of the model along the projected gradient; from there conjugate gradients
lower the model over the entries that are not at a bound. C.-J. Lin, J. J. More, Newton's method for large bound-constrained
optimization problems, SIAM J. Optim. 9 (1999).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_SUFFICIENT = (
    1e-2  # [-] fraction of the linear decrease that a projected step reaches [Lin and More 1999, (3.3)]
)
_HALVINGS = 30  # of a projected step; 2^-30 of it is rounding
# Conjugate gradients end when the residual has fallen to this fraction [Lin and More 1999, section 6], or after as many
# products. Tested by test_products_reach_the_same_minimum.
_RESIDUAL, _PRODUCTS = 0.1, 100


class ProductModel:
    """A linear model of residuals (m,), with functions that multiply their Jacobian (m, n) and its transpose."""

    def __init__(
        self,
        times: Callable[[np.ndarray], np.ndarray],
        transposed_times: Callable[[np.ndarray], np.ndarray],
        residuals: np.ndarray,
        gradient: np.ndarray,
    ):
        self._times, self._transposed_times = times, transposed_times
        self._residuals, self._gradient = residuals, gradient
        self._corners: list[tuple[np.ndarray, np.ndarray]] = []

    def decrease(self, step: np.ndarray) -> float:
        """Return by how much a step that `step` returned lowers half of the sum of squares."""
        return self._decrease(step, self._last_change)

    def step(self, lower: np.ndarray, upper: np.ndarray, radius: float) -> np.ndarray:
        """Return a step within the bounds and the radius that lowers the model.

        Products are taken in the first call only. Later ones, with smaller radii, return points on the path to its step.
        """
        if not self._corners:
            self._corners = self._path(lower, upper, radius)
        (before, change_before), *others = self._corners
        for after, change_after in others:
            fraction = min(1.0, _reach(before, after - before, radius))
            step = before + fraction * (after - before)
            self._last_change: np.ndarray = change_before + fraction * (change_after - change_before)
            if fraction < 1.0:
                break
            before, change_before = after, change_after
        return step

    def _path(
        self, lower: np.ndarray, upper: np.ndarray, radius: float
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the corners of the path to the step, each with the change of the residuals that the model expects."""
        first, change = self._cauchy_step(lower, upper, radius)
        corners = [(np.zeros_like(first), np.zeros_like(change)), (first, change)]
        free = (first > lower) & (first < upper)
        slope = self._gradient + self._transposed_times(change)
        further = first + self._conjugate_gradients(first, slope, free, radius)
        for halving in range(_HALVINGS):
            trial = np.clip(first + 0.5**halving * (further - first), lower, upper)
            change_there = self._times(trial)
            if self._decrease(trial, change_there) >= self._decrease(first, change):
                return [*corners, (trial, change_there)]
        return corners

    def _decrease(self, step: np.ndarray, change: np.ndarray) -> float:
        return -float(self._gradient @ step + 0.5 * change @ change)

    def _cauchy_step(
        self, lower: np.ndarray, upper: np.ndarray, radius: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return a step along the projected gradient that lowers the model sufficiently, and its change of residuals."""
        held = np.where(self._gradient > 0, lower == 0, upper == 0)
        steepest = np.where(held, 0.0, -self._gradient)
        if not steepest.any():
            return steepest, np.zeros_like(self._residuals)
        change = self._times(steepest)
        curvature = float(change @ change)
        size = float(steepest @ steepest)
        length = min(size / curvature if curvature > 0 else np.inf, radius / np.sqrt(size))
        for _ in range(_HALVINGS):
            step = np.clip(length * steepest, lower, upper)
            bent = self._times(step)
            if self._decrease(step, bent) >= -_SUFFICIENT * float(self._gradient @ step):
                break
            length *= 0.5
        return step, bent

    def _conjugate_gradients(
        self, step: np.ndarray, slope: np.ndarray, free: np.ndarray, radius: float
    ) -> np.ndarray:
        """Return a change of the free entries that lowers the model; `step` and it stay within the radius.

        It ends at the radius as T. Steihaug, SIAM J. Numer. Anal. 20 (1983).
        """
        change = np.zeros_like(step)
        residual = np.where(free, -slope, 0.0)
        direction, size = residual.copy(), float(residual @ residual)
        enough = _RESIDUAL**2 * size
        for _ in range(_PRODUCTS):
            if size <= enough:
                break
            bent = self._times(direction)
            curvature = float(bent @ bent)
            reach = _reach(step + change, direction, radius)
            length = size / curvature if curvature > 0 else np.inf
            change = change + min(length, reach) * direction
            if length >= reach:
                break
            residual = residual - length * np.where(free, self._transposed_times(bent), 0.0)
            before, size = size, float(residual @ residual)
            direction = residual + size / before * direction
        return change


def _reach(step: np.ndarray, direction: np.ndarray, radius: float) -> float:
    """Return the largest t with |step + t direction| <= radius."""
    along, size = float(step @ direction), float(direction @ direction)
    if size == 0.0:
        return np.inf
    room = max(radius**2 - float(step @ step), 0.0)
    return (-along + np.sqrt(along**2 + size * room)) / size
