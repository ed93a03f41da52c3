"""Steps of a quadratic model within bounds and a trust region from products alone, for many variables:

    min g . s + c(s) / 2,    lower <= s <= upper,    |s| <= radius

with the curvature c(s) = s . H s of a Hessian H that is never a matrix. A step goes to the Cauchy point, the first minimum
of the model along the projected gradient; from there conjugate gradients lower the model over the entries that are not at a
bound. Where they meet negative curvature they go on to the radius, T. Steihaug, SIAM J. Numer. Anal. 20 (1983). C.-J. Lin,
J. J. More, Newton's method for large bound-constrained optimization problems, SIAM J. Optim. 9 (1999).
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

_SUFFICIENT = (
    1e-2  # [-] fraction of the linear decrease that a projected step reaches [Lin and More 1999, (3.3)]
)
_HALVINGS = 30  # of a projected step; 2^-30 of it is rounding
# Conjugate gradients end when the residual has fallen to this fraction [Lin and More 1999, section 6]. Tested by
# test_products_reach_the_same_minimum.
_RESIDUAL = 0.1


class QuadraticModel(ABC):
    """A quadratic model of an objective about a design, by functions that multiply vectors.

    A subclass defines the image of a step, from which its curvature and the product H s follow: the image may be H s
    itself, or J s where H = J^T J.

    gradient: g, (n,). max_images: that conjugate gradients take at most.
    """

    def __init__(self, gradient: np.ndarray, max_images: int):
        self._gradient, self._max_images = gradient, max_images
        self._corners: list[tuple[np.ndarray, np.ndarray]] = []

    @abstractmethod
    def _image(self, step: np.ndarray) -> np.ndarray:
        """Return the image of a step; it is linear."""

    @abstractmethod
    def _curvature(self, step: np.ndarray, image: np.ndarray) -> float:
        """Return s . H s of a step."""

    @abstractmethod
    def _bent(self, image: np.ndarray) -> np.ndarray:
        """Return H s of the step with this image, (n,)."""

    @abstractmethod
    def _no_image(self) -> np.ndarray:
        """Return the image of no step: zeros."""

    def decrease(self, step: np.ndarray) -> float:
        """Return by how much a step that `step` returned lowers the model."""
        return self._decrease(step, self._last_image)

    def step(self, lower: np.ndarray, upper: np.ndarray, radius: float) -> np.ndarray:
        """Return a step within the bounds and the radius that lowers the model.

        Products are taken in the first call only. Later ones, with smaller radii, return points on the path to its step.
        Raises ValueError if the bounds are not those of the first call.
        """
        if not self._corners:
            self._corners = self._path(lower, upper, radius)
            self._bounds = (lower.copy(), upper.copy())
        elif not all(map(np.array_equal, self._bounds, (lower, upper))):
            raise ValueError(
                "bounds or scale of the optimizer changed after the objective was evaluated: make a new optimizer with them"
            )
        (before, image_before), *others = self._corners
        for after, image_after in others:
            fraction = min(1.0, _reach(before, after - before, radius))
            step = before + fraction * (after - before)
            self._last_image: np.ndarray = image_before + fraction * (image_after - image_before)
            if fraction < 1.0:
                break
            before, image_before = after, image_after
        return step

    def _path(
        self, lower: np.ndarray, upper: np.ndarray, radius: float
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the corners of the path to the step, each with its image."""
        first, image = self._cauchy_step(lower, upper, radius)
        corners = [(np.zeros_like(first), np.zeros_like(image)), (first, image)]
        free = (first > lower) & (first < upper)
        slope = self._gradient + self._bent(image)
        further = first + self._conjugate_gradients(first, slope, free, radius)
        for halving in range(_HALVINGS):
            trial = np.clip(first + 0.5**halving * (further - first), lower, upper)
            image_there = self._image(trial)
            if self._decrease(trial, image_there) >= self._decrease(first, image):
                return [*corners, (trial, image_there)]
        return corners

    def _decrease(self, step: np.ndarray, image: np.ndarray) -> float:
        return -float(self._gradient @ step + 0.5 * self._curvature(step, image))

    def _cauchy_step(
        self, lower: np.ndarray, upper: np.ndarray, radius: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return a step along the projected gradient that lowers the model sufficiently, and its image."""
        held = np.where(self._gradient > 0, lower == 0, upper == 0)
        steepest = np.where(held, 0.0, -self._gradient)
        if not steepest.any():
            return steepest, self._no_image()
        curvature = self._curvature(steepest, self._image(steepest))
        size = float(steepest @ steepest)
        length = min(size / curvature if curvature > 0 else np.inf, radius / np.sqrt(size))
        for _ in range(_HALVINGS):
            step = np.clip(length * steepest, lower, upper)
            image = self._image(step)
            if self._decrease(step, image) >= -_SUFFICIENT * float(self._gradient @ step):
                break
            length *= 0.5
        return step, image

    def _conjugate_gradients(
        self, step: np.ndarray, slope: np.ndarray, free: np.ndarray, radius: float
    ) -> np.ndarray:
        """Return a change of the free entries that lowers the model; `step` and it stay within the radius."""
        change = np.zeros_like(step)
        residual = np.where(free, -slope, 0.0)
        direction, size = residual.copy(), float(residual @ residual)
        enough = _RESIDUAL**2 * size
        for _ in range(self._max_images):
            if size <= enough:
                break
            image = self._image(direction)
            curvature = self._curvature(direction, image)
            reach = _reach(step + change, direction, radius)
            length = size / curvature if curvature > 0 else np.inf
            change = change + min(length, reach) * direction
            if length >= reach:
                break
            residual = residual - length * np.where(free, self._bent(image), 0.0)
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
