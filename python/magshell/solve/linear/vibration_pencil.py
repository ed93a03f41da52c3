"""The eigenvalue problem of small vibrations, K x = w^2 M x, by Lanczos' method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

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


class _Found(NamedTuple):
    """Holds squares (k,), ascending, their modes of all free degrees of freedom (n, k), and the vectors that Lanczos'
    method finds, orthonormal in its inner product.
    """

    squares: np.ndarray
    modes: np.ndarray
    vectors: np.ndarray

    def ordered(self) -> _Found:
        order = np.argsort(self.squares)
        return _Found(self.squares[order], self.modes[:, order], self.vectors[:, order])


class VibrationPencil:
    """K and M, and a factorization of K - shift M with the shift below every square of a frequency.

    stiffness: the parts of K. points: (n, 3) m, where the degrees of freedom are.
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
        *pattern, self._values = stiffness.triangle
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
        stiffest = self._values[self._diagonal][self._moving] / masses[self._moving]
        self._lost = _ROUND_OFF_SHARE * stiffest.max()
        # Below zero, because nothing may resist a rigid motion; and further, the faster something grows.
        self._shift = -max(slow_square, 16.0 * self._lost)
        while self._squares_below(self._shift):
            self._shift *= _SHIFT_GROWTH
            if self._shift < -16.0 * stiffest.max():
                raise NotConverged(
                    "the edge rotations are not stable by themselves, so there are no frequencies"
                )

    def growing(self, lowest: np.ndarray) -> int:
        """Count the negative squares, which are modes that grow. lowest: the lowest squares, which were found."""
        if not self._stiffness.operators:
            return self._squares_below(-self._lost)
        while lowest[-1] < -self._lost and len(lowest) < len(self._moving) - 1:
            lowest, _ = self.lowest(min(2 * len(lowest), len(self._moving) - 1))
        return int(np.count_nonzero(lowest < -self._lost))

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest squares (k,), ascending, and their modes of all free degrees of freedom (n, k)."""
        for attempt in range(_ATTEMPTS):
            space = (2 * count + 20) << attempt
            found = self._search(count, seed=attempt, space=space)
            # A search may miss one of several equal ones.
            if self._stiffness.operators:
                found = self._with_missing(found, space)
            elif not self._complete(found.squares):
                continue
            squares = found.squares
            squares[np.abs(squares) <= self._lost] = 0.0
            return squares, found.modes
        raise NotConverged(f"some of the {count} slowest modes were not found. Ask for more, or for fewer.")

    def _below(self, squares: np.ndarray) -> float:
        """Return a bound so far below the last of the squares that round-off moves none across."""
        return squares[-1] - max(_TOLD_APART * (squares[-1] - self._shift), 2.0 * self._lost)

    def _complete(self, squares: np.ndarray) -> bool:
        """Return whether no lower square is missing: by Sylvester's law K - s M has as many negative pivots as there are
        squares below s.
        """
        below = self._below(squares)
        return self._squares_below(below) == np.count_nonzero(squares < below)

    def _with_missing(self, found: _Found, space: int) -> _Found:
        """Return the lowest squares with those that a search has missed.

        With operators a factorization counts equal squares once. A search for the lowest one among what is orthogonal to the
        modes (Parlett, The Symmetric Eigenvalue Problem, 5.2) finds one of them.
        """
        count = len(found.squares)
        for _ in range(count + 1):
            further = self._search(1, seed=count, space=space, without=found.vectors)
            if further.squares[0] >= self._below(found.squares):
                return found
            pairs = zip(found, further, strict=True)
            found = _Found(*(np.concatenate(pair, axis=-1) for pair in pairs)).ordered()
            found = _Found(*(each[..., :count] for each in found))
        raise NotConverged(f"some of the {count} slowest modes were not found. Ask for more, or for fewer.")

    def _search(self, count: int, seed: int, space: int, without: np.ndarray | None = None) -> _Found:
        """Find the lowest squares. without: vectors found before, to which the modes are orthogonal."""
        # With M = L L^T, y = L^T x and the edge rotations at rest: L^T (K - shift M)^-1 L y = y / (w^2 - shift).
        self._factorize(self._shift)
        if self._consistent is not None:
            return self._search_generalized(count, seed, space, without)
        times_root, times_transposed = self._root

        def moved_by(y: np.ndarray) -> np.ndarray:
            forces = np.zeros(len(self._masses))
            forces[self._moving] = y.ravel()
            return self._factor.solve(times_root(forces))

        size = len(self._moving)
        product = _orthogonal(lambda y: times_transposed(moved_by(y))[self._moving], without, without)
        inverse = scipy.sparse.linalg.LinearOperator((size, size), matvec=product, dtype=np.float64)
        start = np.random.default_rng(seed).standard_normal(size)  # one that no symmetry is orthogonal to
        try:
            inverses, vectors = scipy.sparse.linalg.eigsh(
                inverse, count, which="LA", v0=start, ncv=min(space, size)
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        order = np.argsort(-inverses)
        modes = np.stack([moved_by(vectors[:, k]) for k in order], axis=1)
        return _Found(1.0 / inverses[order] + self._shift, modes, vectors[:, order])

    def _search_generalized(self, count: int, seed: int, space: int, without: np.ndarray | None) -> _Found:
        """Find modes of K x = w^2 M x with M in the inner product: those nearest to the shift are the lowest."""
        size = len(self._masses)
        product = self._factor.solve
        if without is not None:
            product = _orthogonal(product, without, self._consistent @ without)
        inverse = scipy.sparse.linalg.LinearOperator((size, size), matvec=product, dtype=np.float64)
        start = self._factor.solve(self._consistent @ np.random.default_rng(seed).standard_normal(size))
        try:
            squares, modes = scipy.sparse.linalg.eigsh(
                inverse,  # K itself is not needed
                count,
                M=self._consistent,
                sigma=self._shift,
                OPinv=inverse,
                v0=start,
                ncv=min(space, len(self._moving)),
            )
        except scipy.sparse.linalg.ArpackError as error:
            raise NotConverged(f"the vibration modes did not converge: {error}. Ask for fewer.") from error
        return _Found(squares, modes, modes).ordered()

    def _squares_below(self, square: float) -> int:
        """Count the squares below one. With operators equal ones count once, and zero means none."""
        return self._factorize(square).negative_pivots

    def _factorize(self, shift: float) -> _core.FactorReport:
        values = self._values.copy()
        if self._inertia is None:
            values[self._diagonal] -= shift * self._masses
        else:
            values -= shift * self._inertia
        self.factorizations += 1
        parts = self._stiffness
        report = factorize(self._factor, parts._replace(triangle=(*parts.triangle[:3], values)))
        if not report.succeeded:
            raise NotConverged(f"the vibration modes: {report.reason}")
        return report


def _orthogonal(
    product: Callable[[np.ndarray], np.ndarray], vectors: np.ndarray | None, duals: np.ndarray | None
) -> Callable[[np.ndarray], np.ndarray]:
    """Return a symmetric product between what is orthogonal to its eigenvectors (n, k); zero for these.

    duals: the vectors times the matrix of the inner product.
    """
    if vectors is None or duals is None:
        return product

    def between(x: np.ndarray) -> np.ndarray:
        y = product(x)
        return y - vectors @ (duals.T @ y)

    return between


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
