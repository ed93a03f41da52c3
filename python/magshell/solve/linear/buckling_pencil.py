"""The eigenvalue problem of linear buckling, (K + f dK) v = 0, by Lanczos' method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ..adjoint.factorized import StiffnessParts
from .stiffness import Stiffness

_SAME = 1e-6  # of a factor: another one that is less below it is taken for it
_ROUGH = 1e-3  # of an eigenvalue, where only its side of a bound counts


class BucklingPencil:
    """A positive definite K and its change dK: -dK v = (1/f) K v, so that the smallest positive factors f are the largest
    eigenvalues.
    """

    def __init__(self, stiffness: Stiffness, change: StiffnessParts):
        matrix = stiffness.matrix
        self._size = matrix.shape[0]
        self._solve = stiffness.solve
        self._stiffness = self._completed(matrix, stiffness.parts, 1.0)
        self._negative_change = self._completed(-stiffness.with_values(change.triangle[3]), change, -1.0)

    def extreme(self) -> float:
        """Return the inverse of the factor nearest to zero, of either sign, by its size."""
        return abs(self._search(self._negative_change, 1, which="LM", return_eigenvectors=False)[0])

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest positive factors (k,), ascending, and their modes (n, k) with v . K v = 1."""
        inverses, vectors = self._search(self._negative_change, count, which="LA")
        order = np.argsort(-inverses)
        return 1.0 / inverses[order], vectors[:, order]

    def with_missing(
        self, factors: np.ndarray, modes: np.ndarray, count: int, largest: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return up to `count` factors with those below `largest` that a search has missed: equal ones, say.

        A search for the next one among what is orthogonal to the modes (Parlett, The Symmetric Eigenvalue Problem, 5.2) does
        not miss it, as it is simple or one of several equal ones.
        """
        while True:
            bound = 1.0 / (largest if len(factors) < count else factors[-1] * (1.0 - _SAME))
            further = self._without(factors, modes)
            (inverse,), _ = self._search(further, 1, which="LA", tol=_ROUGH)
            if inverse * (1.0 + 2.0 * _ROUGH) > bound:
                (inverse,), vectors = self._search(further, 1, which="LA")
                if inverse > bound:
                    factors, modes = np.append(factors, 1.0 / inverse), np.hstack([modes, vectors])
                    order = np.argsort(factors)[:count]
                    factors, modes = factors[order], modes[:, order]
                    continue
            return factors, modes

    def _search(self, negative_change: Any, count: int, **options: Any) -> Any:
        start = np.random.default_rng(0).standard_normal(self._size)  # one that no symmetry is orthogonal to
        return scipy.sparse.linalg.eigsh(
            negative_change,
            count,
            M=self._stiffness,
            Minv=self._operator(self._solve),
            v0=start,
            **options,
        )

    def _completed(self, matrix: scipy.sparse.csc_array, parts: StiffnessParts, sign: float) -> Any:
        """Return a matrix with the parts that are not in it, times a sign."""
        if not parts.operators and not parts.low_rank:
            return matrix
        return self._operator(lambda v: matrix @ v + sign * parts.times_others(v))

    def _without(self, factors: np.ndarray, modes: np.ndarray) -> Any:
        """Return -dK with the eigenvalue zero for these modes."""
        forces = np.stack([self._stiffness @ mode for mode in modes.T], axis=1)
        return self._operator(lambda v: self._negative_change @ v - forces @ (forces.T @ v / factors))

    def _operator(self, product: Callable[[np.ndarray], np.ndarray]) -> scipy.sparse.linalg.LinearOperator:
        return scipy.sparse.linalg.LinearOperator(
            (self._size, self._size), matvec=lambda v: product(v.ravel()), dtype=np.float64
        )
