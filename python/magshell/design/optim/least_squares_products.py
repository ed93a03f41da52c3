"""A linear least-squares model by products with its Jacobian alone, for many residuals of many parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .quadratic_model import QuadraticModel

# Conjugate gradients take as many products at most. Tested by test_products_reach_the_same_minimum.
_PRODUCTS = 100


class ProductModel(QuadraticModel):
    """Half of the squares |J s + r|^2 of residuals r (m,), by functions that multiply J (m, n) and its transpose."""

    def __init__(
        self,
        times: Callable[[np.ndarray], np.ndarray],
        transposed_times: Callable[[np.ndarray], np.ndarray],
        residuals: np.ndarray,
        gradient: np.ndarray,
    ):
        super().__init__(gradient, _PRODUCTS)
        self._times, self._transposed_times, self._residuals = times, transposed_times, residuals

    def _image(self, step: np.ndarray) -> np.ndarray:
        return self._times(step)

    def _curvature(self, step: np.ndarray, image: np.ndarray) -> float:
        return float(image @ image)

    def _bent(self, image: np.ndarray) -> np.ndarray:
        return self._transposed_times(image)

    def _no_image(self) -> np.ndarray:
        return np.zeros_like(self._residuals)
