"""Uncertainty of fitted coordinates, to first order (Laplace), from the Jacobian of the residuals."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..._runtime.frozen import Frozen, read_only

_SINGULAR = 1e-9  # [-] singular values below this fraction of the largest one are round-off of the Jacobian
_INVOLVED = 1e-6  # [-] an entry of a unit direction below this is round-off
_VAGUE = 1.0  # [sizes] standard deviation along a direction above which the data count as not determining it


class Uncertainty(Frozen):
    """The distribution of fitted coordinates about their estimate, normal to first order.

    jacobian: (m, n), of residuals over their standard deviations. sizes: large changes of the coordinates, (n,).
    at_bounds: coordinates that a bound holds, (n,); they count as known.
    """

    def __init__(self, jacobian: np.ndarray, sizes: np.ndarray, at_bounds: np.ndarray):
        self.sizes: np.ndarray = sizes
        self._moving = ~at_bounds
        scaled = jacobian[:, self._moving] * sizes[self._moving]
        _, values, directions = np.linalg.svd(scaled, full_matrices=True)
        self.singular_values: np.ndarray = np.pad(values, (0, len(directions) - values.size))
        self._directions = directions
        self._singular = self.singular_values <= _SINGULAR * self.singular_values.max(initial=0.0)

    @property
    def is_singular(self) -> bool:
        """Return whether a combination of coordinates has no influence on the residuals at all."""
        return bool(self._singular.any())

    @cached_property
    def covariance(self) -> np.ndarray:
        """The covariance of all coordinates, (n, n); zero for those at bounds. Undefined if it is singular."""
        found = self._root @ self._root.T
        read_only(found)
        return found

    @cached_property
    def _root(self) -> np.ndarray:
        """A matrix R with covariance R R^T, (n, k), without singular directions."""
        known = ~self._singular
        root = np.zeros((self._moving.size, int(known.sum())))
        root[self._moving] = self._directions[known].T / self.singular_values[known]
        return root * self.sizes[:, None]

    @cached_property
    def _free(self) -> np.ndarray:
        """The singular directions of all coordinates, in sizes, (k, n)."""
        free = np.zeros((int(self._singular.sum()), self._moving.size))
        free[:, self._moving] = self._directions[self._singular]
        return free

    def deviations_of(self, jacobian: np.ndarray) -> np.ndarray:
        """Return the standard deviations of functions of the coordinates with this Jacobian, (k,); infinite where a
        singular direction changes them."""
        found = np.linalg.norm(jacobian @ self._root, axis=1)
        scaled = jacobian * self.sizes
        along = np.abs(scaled @ self._free.T).max(axis=1, initial=0.0)
        return np.where(along > _INVOLVED * np.linalg.norm(scaled, axis=1), np.inf, found)

    @property
    def vague(self) -> list[tuple[float, np.ndarray]]:
        """The directions that the data do not determine: [(change of the data, direction (n,) in sizes)]."""
        found = []
        for value, row in zip(self.singular_values, self._directions, strict=True):
            if value * _VAGUE < 1.0:
                direction = np.zeros(self._moving.size)
                direction[self._moving] = row * np.sign(row[np.abs(row).argmax()])
                found.append((float(value), direction))
        return found
