"""The eigenvalue problem of small vibrations, K x = w^2 M x, by Lanczos' method."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from ... import _core
from ...errors import NotConverged
from ..adjoint.factorized import StiffnessParts, factorize
from .stiffness import symmetric

_ROUND_OFF_SHARE = (
    64.0 * np.finfo(float).eps
)  # of the fastest vibration's square: below, a square is round-off
_SHIFT_GROWTH = 8.0
_ATTEMPTS = 3  # each searches a larger space
_TOLD_APART = (
    1e-6  # squares that differ by less, relative to their distance from the shift, are not told apart
)


class VibrationPencil:
    """K and M, and a factorization of K - shift M with the shift below every square of a frequency.

    stiffness: the parts of K, without operators. points: (n, 3) m, where the degrees of freedom are.
    masses: (n,), the diagonal of M, zero for edge rotations. inertia: M at the nonzeros of K, if it is not diagonal.
    consistent: M (n, n), if it is the consistent matrix, of which no root is computed.
    slow_square: 1/s2, estimate of the lowest square of a sheet that is held.
    """

    def __init__(
        self,
        stiffness: StiffnessParts,
        points: np.ndarray,
        masses: np.ndarray,
        slow_square: float,
        inertia: np.ndarray | None = None,
        consistent: scipy.sparse.csc_array | None = None,
    ):
        *pattern, values = stiffness.triangle
        self._stiffness = stiffness
        self._diagonal = pattern[1][:-1]
        self._masses = masses
        self._moving = np.flatnonzero(masses)
        self._inertia = inertia
        self._consistent = consistent
        if consistent is None:
            self._root = (
                _root(masses) if inertia is None else _coupled_root(symmetric(*pattern, inertia), masses)
            )
        self._factor = _core.analyze(*pattern, points=points)
        self.factorizations: int = 0
        stiffest = values[self._diagonal][self._moving] / masses[self._moving]
        self._lost = _ROUND_OFF_SHARE * stiffest.max()
        # Below zero, because nothing may resist a rigid motion; and further, the faster something grows.
        self.shift: float = -max(slow_square, 16.0 * self._lost)
        self.largest_shift: float = 16.0 * stiffest.max()
        while self._squares_below(self.shift):
            self.shift *= _SHIFT_GROWTH
            if self.shift < -self.largest_shift:
                raise NotConverged(
                    "the edge rotations are not stable by themselves, so there are no frequencies"
                )

    def growing(self, lowest: np.ndarray) -> int:
        """Count the negative squares, which are modes that grow. lowest: the lowest squares, which were found."""
        return self._squares_below(-self._lost)

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest squares (k,), ascending, and their modes of all free degrees of freedom (n, k)."""
        for attempt in range(_ATTEMPTS):
            squares, modes = self._search(count, seed=attempt, space=(2 * count + 20) << attempt)
            if self._complete(squares):
                return self.without_round_off(squares), modes
        raise NotConverged(f"some of the {count} slowest modes were not found. Ask for more, or for fewer.")

    def without_round_off(self, squares: np.ndarray) -> np.ndarray:
        """Return squares (k,), zero where they are round-off."""
        return np.where(np.abs(squares) <= self._lost, 0.0, squares)

    def _complete(self, squares: np.ndarray) -> bool:
        """Return whether no lower square is missing, as a search may miss one of several equal ones: by Sylvester's law
        K - s M has as many negative pivots as there are squares below s.
        """
        # So far below the last of them that round-off moves none across.
        below = squares[-1] - max(_TOLD_APART * (squares[-1] - self.shift), 2.0 * self._lost)
        return self._squares_below(below) == np.count_nonzero(squares < below)

    def _search(self, count: int, seed: int, space: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest squares, ascending, and their modes, by vectors of a random start."""
        # With M = L L^T, y = L^T x and the edge rotations at rest: L^T (K - shift M)^-1 L y = y / (w^2 - shift).
        self._factorize(self.shift)
        if self._consistent is not None:
            return self._search_generalized(count, seed, space)
        times_root, times_transposed = self._root

        def moved_by(y: np.ndarray) -> np.ndarray:
            forces = np.zeros(len(self._masses))
            forces[self._moving] = y.ravel()
            return self._factor.solve(times_root(forces))

        size = len(self._moving)
        inverse = scipy.sparse.linalg.LinearOperator(
            (size, size), matvec=lambda y: times_transposed(moved_by(y))[self._moving], dtype=np.float64
        )
        start = np.random.default_rng(seed).standard_normal(size)  # one that no symmetry is orthogonal to
        try:
            inverses, vectors = scipy.sparse.linalg.eigsh(
                inverse, count, which="LA", v0=start, ncv=min(space, size)
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        order = np.argsort(-inverses)
        modes = np.stack([moved_by(vectors[:, k]) for k in order], axis=1)
        return 1.0 / inverses[order] + self.shift, modes

    def _search_generalized(self, count: int, seed: int, space: int) -> tuple[np.ndarray, np.ndarray]:
        """Find modes of K x = w^2 M x with M in the inner product: those nearest to the shift are the lowest."""
        size = len(self._masses)
        inverse = scipy.sparse.linalg.LinearOperator(
            (size, size), matvec=self._factor.solve, dtype=np.float64
        )
        start = self._factor.solve(self._consistent @ np.random.default_rng(seed).standard_normal(size))
        try:
            squares, modes = scipy.sparse.linalg.eigsh(
                inverse,  # K itself is not needed
                count,
                M=self._consistent,
                sigma=self.shift,
                OPinv=inverse,
                v0=start,
                ncv=min(space, len(self._moving)),
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        order = np.argsort(squares)
        return squares[order], modes[:, order]

    def _squares_below(self, square: float) -> int:
        """Count the squares below one."""
        return self._factorize(square).negative_pivots

    def shifted(self, shift: float) -> StiffnessParts:
        """Return the parts of K - shift M."""
        *pattern, values = self._stiffness.triangle
        values = values.copy()
        if self._inertia is None:
            values[self._diagonal] -= shift * self._masses
        else:
            values -= shift * self._inertia
        return self._stiffness._replace(triangle=(*pattern, values))

    def _factorize(self, shift: float) -> _core.FactorReport:
        self.factorizations += 1
        report = factorize(self._factor, self.shifted(shift))
        if not report.succeeded:
            raise NotConverged(f"the vibration modes: {report.reason}")
        return report


def _root(masses: np.ndarray) -> tuple[Any, ...]:
    """Return the functions that multiply by L and by L^T, for a diagonal M = L L^T."""
    roots = np.sqrt(masses)
    return (lambda x: roots * x), (lambda x: roots * x)


def _coupled_root(inertia, masses: np.ndarray) -> tuple[Any, ...]:
    """Return the functions that multiply by L and by L^T, for an M whose last rows, of rigid bodies, are coupled."""
    coupled = inertia.copy()
    coupled.setdiag(0.0)
    coupled.eliminate_zeros()
    first = coupled.indices.min(initial=len(masses))
    root = scipy.sparse.diags_array(np.sqrt(masses)).tolil()
    if first < len(masses):
        root[first:, first:] = np.linalg.cholesky(inertia[first:, first:].toarray())
    root = root.tocsc()
    return (lambda x: root @ x), (lambda x: root.T @ x)
