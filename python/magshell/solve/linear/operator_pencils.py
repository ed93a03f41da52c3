"""Eigenvalue problems of linear theory with operators, the own field of large scenes, which are known by their products."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

import numpy as np
import scipy

from ...errors import NotConverged
from ..adjoint.factorized import Factorized, StiffnessParts, analyzed, factorize, times_operators
from .largest_eigenvalues import IndefiniteMatrix, LargestEigenvalues, Product, Products
from .stiffness import IndefiniteStiffness, Stiffness, is_positive_definite, refuse_indefinite, symmetric
from .vibration_pencil import VibrationPencil

# Parts of the diagonal that are added to a sparse matrix until it is positive definite. Tested by
# test_modes_where_the_own_field_alone_holds_a_strip.
_PARTS = 10.0 ** np.arange(-7, 2)
# The largest shift of squares with operators, over that without, before massless degrees of freedom are taken for unstable.
_MORE_SHIFT = 1e3
_FURTHER = 2  # modes without the operators, beyond those asked for, from which a search starts


class OperatorVibrationPencil:
    """The eigenvalue problem of small vibrations, K x = w^2 M x, with operators in K. Arguments as in VibrationPencil."""

    def __init__(
        self,
        stiffness: StiffnessParts,
        points: np.ndarray,
        masses: np.ndarray,
        slow_square: float,
        inertia: np.ndarray | None = None,
        consistent: scipy.sparse.csc_array | None = None,
    ):
        self._operators, self._points = stiffness.operators, points
        sparse = stiffness._replace(operators=())
        self._sparse = VibrationPencil(sparse, points, masses, slow_square, inertia, consistent)
        self._moving = np.count_nonzero(masses)
        self._mass = scipy.sparse.diags_array(masses)
        if consistent is not None or inertia is not None:
            self._mass = consistent if inertia is None else symmetric(*stiffness.triangle[:3], inertia)
        self._shift, self._searches = self._sparse.shift, 0
        self._search = self._new_search()

    @property
    def factorizations(self) -> int:
        """The number of factorizations, but for those of approximations near single squares."""
        return self._sparse.factorizations + self._searches

    def growing(self, lowest: np.ndarray) -> int:
        """Count the negative squares, which are modes that grow. lowest: the lowest squares, which were found."""
        while lowest[-1] < 0.0 and len(lowest) < self._moving - 1:
            lowest, _ = self.lowest(min(2 * len(lowest), self._moving - 1))
        return int(np.count_nonzero(lowest < 0.0))

    def lowest(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest squares (k,), ascending, and their modes of all free degrees of freedom (n, k)."""
        _, vectors = self._sparse.lowest(min(count + _FURTHER, self._moving - 1))
        self._search.start_at_random(1)
        while True:
            self._search.start(vectors)
            try:
                found = self._search.find(count)
            except IndefiniteMatrix as indefinite:
                # Not the whole way, as the quotient of a direction is above the lowest square.
                self._shift += min(7.0 * self._shift, 2.0 * indefinite.quotient)
                if not self._shift >= -_MORE_SHIFT * self._sparse.largest_shift:
                    raise NotConverged(
                        "the edge rotations are not stable by themselves, so there are no frequencies"
                    ) from indefinite
                self._search = self._new_search()
                vectors = np.column_stack([indefinite.direction, vectors])
                continue
            return self._sparse.without_round_off(self._shift + 1.0 / found.values), found.vectors

    def _new_search(self) -> LargestEigenvalues:
        """Return a search for squares of which none is below the shift."""
        shifted = self._sparse.shifted(self._shift)
        shift, self._searches = self._shift, self._searches + 1
        return LargestEigenvalues(
            _products(
                shifted,
                Factorized(shifted, self._points),
                lambda v: times_operators(self._operators, v),
                lambda v: self._mass @ v,
                _Nearby(self._points, lambda inverse: self._sparse.shifted(shift + inverse)),
            )
        )


class OperatorBucklingPencil:
    """A positive definite K and its change dK, of which one has operators: K v = -f dK v."""

    def __init__(self, stiffness: Stiffness, change: StiffnessParts):
        self._where = stiffness.where
        parts = stiffness.parts
        sparse, added, factorized = _positive_definite(stiffness)
        changed = stiffness.with_values(change.triangle[3])
        products = _products(
            sparse,
            factorized,
            lambda v: times_operators(parts.operators, v) - added * v,
            lambda v: -(changed @ v + change.times_others(v)),
            _Nearby(stiffness.points, lambda inverse: stiffness.moved(change, inverse)),
        )
        self._search = LargestEigenvalues(products)

    def extreme(self) -> float:
        """Return roughly the inverse of the factor nearest to zero, of either sign, by its size."""
        with self._refused():
            self._search.start_at_random(_FURTHER)
            return self._search.extreme()

    def lowest(self, count: int, largest: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest positive factors (k,) up to the largest one, ascending, and modes (n, k) with v . K v = 1."""
        with self._refused():
            self._search.start_at_random(count)
            found = self._search.find(count, above=1.0 / largest)
        return 1.0 / found.values, found.vectors

    @contextlib.contextmanager
    def _refused(self) -> Iterator[None]:
        """Raise IndefiniteStiffness where K is not positive definite."""
        try:
            yield
        except IndefiniteMatrix as indefinite:
            raise IndefiniteStiffness(
                f"the stiffness {self._where} is not positive definite, and linear theory needs that: add supports"
            ) from indefinite


class _Nearby:
    """Solves with a matrix for each number, which is factorized with one analysis."""

    def __init__(self, points: np.ndarray, parts: Callable[[float], StiffnessParts]):
        self._parts = parts
        self._factor = analyzed(*parts(0.0).triangle[:3], points)

    def __call__(self, number: float) -> Product:
        factorize(self._factor, self._parts(number))
        return self._factor.solve


def _products(
    sparse: StiffnessParts,
    factorized: Factorized,
    others: Product,
    change: Product,
    near: Callable[[float], Product],
) -> Products:
    """Return the products of a pencil whose positive definite part is sparse."""
    matrix = symmetric(*sparse.triangle)

    def product(vector: np.ndarray) -> np.ndarray:
        return matrix @ vector + sparse.times_others(vector)

    return Products(factorized.solve, product, others, change, matrix.diagonal(), near)


def _positive_definite(stiffness: Stiffness) -> tuple[StiffnessParts, np.ndarray, Factorized]:
    """Return the sparse part of a stiffness with as much added to its diagonal (n,) as makes it positive definite, what was
    added, and its factorization.
    """
    parts = stiffness.parts._replace(operators=())
    size, starts, rows, values = parts.triangle
    for part in (0.0, *_PARTS):
        added = part * np.abs(values[starts[:-1]])
        moved = values.copy()
        moved[starts[:-1]] += added
        positive = parts._replace(triangle=(size, starts, rows, moved))
        factorized = Factorized(positive, stiffness.points)
        if is_positive_definite(factorized.report):
            break
    refuse_indefinite(factorized.report, size, stiffness.where)
    return positive, added, factorized
