"""The largest eigenvalues of N x = mu K x for matrices that are known by products, by Davidson's method.

K = P + H is positive definite, with P factorized. The vectors V span a space and are orthonormal in the inner product of P.
In each step the Rayleigh-Ritz method finds the best pairs (mu, x) in it. The space is extended by

    P^-1 r,                   r = N x - mu K x
    S^-1 r - e S^-1 K x,      e so that this is orthogonal to K x, once mu is known roughly      [Olsen90]

with a factorized S that is K - N / mu but for what is known by products. A new vector takes one product with H and one with
N. Its product with P is known without rounding, as the vector is found by a solve.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from ... import _core
from ...errors import NotConverged

Product = Callable[[np.ndarray], np.ndarray]

# [-] Error bound of an eigenvalue from its residual, over the eigenvalue: to reach, and the largest that is accepted where
# round-off leaves no smaller one. The error itself is of the order of the square. Tested by
# test_frequencies_equal_those_of_a_dense_decomposition.
_TIGHT, _ACCEPTABLE = 1e-10, 1e-8
_ROUGH = 0.1  # [-] the same for the extreme eigenvalue, which limits a range
_NEAR = (
    0.1  # [-] length of r, over mu, from which on S extends the space; before, it leads to another eigenvalue
)
_BLOCK = 4  # new vectors in a step
_KEPT = 8  # vectors beyond those of wanted eigenvalues that a restart keeps
_SPACE = 50  # vectors beyond three for each wanted eigenvalue at which the method restarts
_STEPS = 200  # largest number of steps
_STALLED = 10  # steps without a smaller error after which an acceptable one is taken
_SAME = 1e-6  # of an eigenvalue: another one that is less above it is taken for it
_DEPENDENT = 1e-10  # part of a vector outside the space below which it adds nothing
_SEARCHES = 10  # for eigenvalues that were missed


class IndefiniteMatrix(ArithmeticError):
    """An error for a K that is not positive definite.

    direction: x (n,) with a negative x . K x. quotient: that over x . N x.
    """

    def __init__(self, direction: np.ndarray, quotient: float):
        super().__init__(direction, quotient)
        self.direction: np.ndarray = direction
        self.quotient: float = quotient


class Products(NamedTuple):
    """The matrices of a pencil of size n: solves and products with P, products with H and N, and the diagonal of P (n,).

    near: returns the solve with the S of 1/mu.
    """

    solve: Product
    factorized: Product
    others: Product
    change: Product
    diagonal: np.ndarray
    near: Callable[[float], Product]


class Eigenpairs(NamedTuple):
    """Holds eigenvalues (k,), descending, their vectors (n, k) with x . K x = 1, and K times these."""

    values: np.ndarray
    vectors: np.ndarray
    forces: np.ndarray


class LargestEigenvalues:
    """A search for the largest eigenvalues, whose space later searches start from. Raises IndefiniteMatrix where K is not
    positive definite.
    """

    def __init__(self, products: Products):
        self._products = products
        nothing = np.zeros((len(products.diagonal), 0))
        self._vectors, self._images, self._others, self._changes = nothing, nothing, nothing, nothing

    def start(self, vectors: np.ndarray) -> None:
        """Add vectors (n, k) to the space."""
        for vector in vectors.T:
            self._add(self._products.factorized(vector))

    def start_at_random(self, count: int) -> None:
        """Add vectors to the space in which unknowns of all units take part, and which no symmetry is orthogonal to."""
        rng, scale = np.random.default_rng(0), np.sqrt(np.abs(self._products.diagonal))
        for _ in range(count):
            self._add(scale * rng.standard_normal(len(scale)))

    def extreme(self) -> float:
        """Return roughly the largest eigenvalue by size."""
        values, _, _ = self._improve(
            lambda values: np.array([0, len(values) - 1]),
            lambda values, errors: errors <= _ROUGH * np.abs(values).max(),
        )
        return float(np.abs(values).max())

    def find(self, count: int, above: float = 0.0) -> Eigenpairs:
        """Return up to `count` of the largest eigenvalues, those above a bound of at least zero.

        Raises NotConverged, also where an eigenvalue may have been missed, with an estimated probability of 1e-3.
        """

        def is_known(values: np.ndarray, errors: np.ndarray) -> np.ndarray:
            return (errors <= _TIGHT * values) | (values + errors < above)

        for _ in range(_SEARCHES):
            found = self._improve(lambda values: np.arange(min(count, len(values))), is_known)
            found = Eigenpairs(*(each[..., found.values > above] for each in found))
            last = found.values[-1] * (1.0 + _SAME) if len(found.values) == count else above
            if not last > 0.0:
                raise NotConverged(f"only {len(found.values)} of {count} modes were found. Ask for fewer.")
            missed = self._missed(found, last)
            if not missed.shape[1]:
                return found
            self.start(missed)
        raise NotConverged(f"some of the {count} lowest modes were not found. Ask for more, or for fewer.")

    def _improve(
        self,
        chosen: Callable[[np.ndarray], np.ndarray],
        is_known: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ) -> Eigenpairs:
        """Return Ritz pairs after extending the space until those that are chosen by their values are known.

        is_known: of eigenvalues and the bounds of their errors.
        """
        best, waited = np.inf, 0
        for _ in range(_STEPS):
            values, coefficients, least = self._ritz()
            wanted = chosen(values)
            if self._vectors.shape[1] > 3 * len(wanted) + _SPACE:
                self._restart(coefficients, wanted)
                continue
            found = Eigenpairs(
                values[wanted], *(each @ coefficients[:, wanted] for each in (self._vectors, self._stiff))
            )
            residuals = self._changes @ coefficients[:, wanted] - found.values * found.forces
            lengths = np.array([np.sqrt(max(0.0, each @ self._products.solve(each))) for each in residuals.T])
            errors = lengths / np.sqrt(least)
            unknown = np.flatnonzero(~is_known(found.values, errors))
            if not len(unknown):
                return found
            worst = (errors / np.abs(found.values))[unknown].max()
            best, waited = (worst, 0) if worst < 0.5 * best else (best, waited + 1)
            added = [
                self._add(
                    self._correction(found.values[k], found.forces[:, k], residuals[:, k])
                    if lengths[k] < _NEAR * abs(found.values[k])
                    else residuals[:, k]
                )
                for k in unknown[:_BLOCK]
            ]
            if not any(added) or (waited > _STALLED and worst <= _ACCEPTABLE):
                break
        if worst > _ACCEPTABLE:
            raise NotConverged(
                f"the modes did not converge: the error bound of an eigenvalue is {worst:.1e} of it. Ask for fewer modes."
            )
        return found

    def _correction(self, value: float, forces: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """Return P times the correction of a vector x, for an approximate eigenvalue; forces: K x."""
        solve = self._products.near(1.0 / value)
        vector, along = solve(residual), solve(forces)
        vector = vector - (forces @ vector) / (forces @ along) * along
        return self._products.factorized(vector) if np.all(np.isfinite(vector)) else residual

    @property
    def _stiff(self) -> np.ndarray:
        """The products of K with the vectors."""
        return self._images + self._others

    def _add(self, forces: np.ndarray) -> bool:
        """Add P^-1 forces to the space, and return whether that made it larger."""
        vector = self._products.solve(forces)
        before = forces @ vector
        for _ in range(2):
            coefficients = self._images.T @ vector
            vector, forces = vector - self._vectors @ coefficients, forces - self._images @ coefficients
        after = forces @ vector
        if not after > _DEPENDENT**2 * before:
            return False
        # Solving again makes the vector belong to the forces to round-off.
        forces = forces / np.sqrt(after)
        vector = self._products.solve(forces)
        self._vectors, self._images, self._others, self._changes = (
            np.column_stack([each, column])
            for each, column in (
                (self._vectors, vector),
                (self._images, forces),
                (self._others, self._products.others(vector)),
                (self._changes, self._products.change(vector)),
            )
        )
        return True

    def _ritz(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the Ritz values, descending, the coefficients of their vectors, and the least eigenvalue of P^-1 K in the
        space.
        """
        change, stiffness = (self._vectors.T @ each for each in (self._changes, self._stiff))
        change, stiffness = (0.5 * (each + each.T) for each in (change, stiffness))
        if not np.all(np.isfinite(stiffness)) or not np.all(np.isfinite(change)):
            raise NotConverged("the modes did not converge: a product with the stiffness is not finite")
        of_stiffness, directions = np.linalg.eigh(stiffness)
        if of_stiffness[0] <= 0.0:
            lowest = directions[:, 0]
            raise IndefiniteMatrix(self._vectors @ lowest, of_stiffness[0] / (lowest @ change @ lowest))
        values, coefficients = scipy.linalg.eigh(change, stiffness)
        return values[::-1], coefficients[:, ::-1], of_stiffness[0]

    def _restart(self, coefficients: np.ndarray, wanted: np.ndarray) -> None:
        """Keep the space of the wanted Ritz vectors and some of the next ones."""
        kept = np.union1d(wanted, np.arange(len(wanted) + _KEPT))
        orthonormal, _ = np.linalg.qr(coefficients[:, kept])
        self._vectors, self._images, self._others, self._changes = (
            each @ orthonormal for each in (self._vectors, self._images, self._others, self._changes)
        )

    def _missed(self, found: Eigenpairs, bound: float) -> np.ndarray:
        """Return approximate vectors (n, k) of further eigenvalues above a bound.

        By Sylvester's law K - N / bound has a negative direction for each eigenvalue above the bound. Those that are found
        are made positive.
        """
        weights = found.values / bound

        def product(vector: np.ndarray) -> np.ndarray:
            others = self._products.others(vector) - self._products.change(vector) / bound
            return others + found.forces @ (weights * (found.forces.T @ vector))

        settled, missed = _core.directions_below(self._products.solve, product, self._products.diagonal, -1.0)
        if not settled:
            raise NotConverged(
                "a mode between those that were found may be missing. Ask for more, or for fewer."
            )
        return missed
