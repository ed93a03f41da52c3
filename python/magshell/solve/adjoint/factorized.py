"""Factorizes stiffness matrices, and solves with them to more digits than a factorization alone gives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import _core

_SMALL = 20000  # degrees of freedom, up to which trying two orderings costs more than the better one saves
# Degrees of freedom up to which an eigenvalue problem takes operators as dense matrices: one product for each of them. A
# search takes as many products for a few modes; see test_frequencies_equal_those_of_a_dense_decomposition.
_MOST_DENSE = 200
# Residual of an iterative solve over the right-hand side. Each of two solves has it, so that together they have its square;
# see test_operator_factor_solves_and_counts_as_the_dense_matrix.
_PART = 1e-7


class StiffnessParts(NamedTuple):
    """The Hessian of the free degrees of freedom: a sparse matrix, columns of low rank, and operators.

    triangle: (size, column starts, rows, nonzeros), the lower triangle of the matrix. low_rank: columns u (n, k) and their
    stiffnesses s (k,), for the sum of s u u^T; () if there are none. operators: (weight, operator) of what is known by its
    products only, the own field.
    """

    triangle: tuple[int, np.ndarray, np.ndarray, np.ndarray]
    low_rank: tuple[np.ndarray, ...] = ()
    operators: tuple[tuple[float, _core.OperatorPart], ...] = ()

    def times_others(self, vector: np.ndarray) -> np.ndarray:
        """Return the product of everything but the sparse matrix with a vector (n,)."""
        product = times_low_rank(self.low_rank, vector) if self.low_rank else np.zeros_like(vector)
        return product + times_operators(self.operators, vector)

    @property
    def fits_dense(self) -> bool:
        """Return whether the operators may become a dense matrix."""
        return self.triangle[0] <= _MOST_DENSE

    def dense(self) -> StiffnessParts:
        """Return the same with a matrix of full pattern, which contains the operators."""
        size, starts, rows, values = self.triangle
        columns = np.repeat(np.arange(size), np.diff(starts))
        matrix = np.zeros((size, size))
        for k, unit in enumerate(np.eye(size) if self.operators else ()):
            matrix[:, k] = times_operators(self.operators, unit)
        matrix = 0.5 * (matrix + matrix.T)
        matrix[rows, columns] += values
        full_columns, full_rows = np.triu_indices(size)
        full_starts = np.concatenate([[0], np.cumsum(np.arange(size, 0, -1))])
        triangle = (size, full_starts, full_rows, matrix[full_rows, full_columns])
        return StiffnessParts(triangle, self.low_rank)


def stiffness_parts(model: _core.Model, state: np.ndarray, load_parameters: np.ndarray) -> StiffnessParts:
    """Return the parts of the Hessian of a model at a state."""
    triangle, (columns, stiffnesses), operator = model.hessian_parts(state, load_parameters)
    low_rank = (columns, stiffnesses) if np.any(stiffnesses) else ()
    return StiffnessParts(triangle, low_rank, () if operator is None else ((1.0, operator),))


class Factorized:
    """A factorized symmetric matrix with further parts, which solves to more digits than the factorization has.

    points: (n, 3) m, where the degrees of freedom are. report: of the factorization. With operators solves are iterative,
    and equal negative eigenvalues count once in the report. counted: whether the report is needed; a count with operators
    takes as many products as a solve.
    """

    def __init__(self, parts: StiffnessParts, points: np.ndarray, counted: bool = True):
        self._parts = parts
        *pattern, self._values = parts.triangle
        self._factor = analyzed(*pattern, points)
        self.report: _core.FactorReport = factorize(self._factor, parts, counted)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Solve, with one refinement by a residual of more digits.

        Without it, where stiffnesses differ by 1e6, the digits of the soft ones would depend on the order of elimination.
        """
        solution = self._factor.solve_approximately(forces, _PART)
        left = self._factor.residual(self._values, solution, forces)
        if self._parts.low_rank or self._parts.operators:
            left = left - self._parts.times_others(solution)
        return solution + self._factor.solve_approximately(left, _PART)


def analyzed(size: int, starts: np.ndarray, rows: np.ndarray, points: np.ndarray) -> _core.Factor:
    """Return the symbolic factorization of a matrix of which the lower triangle has these places."""
    return _core.analyze(size, starts, rows, points=points, ordering="amd" if size <= _SMALL else "best")


def factorize(factor: _core.Factor, parts: StiffnessParts, counted: bool = True) -> _core.FactorReport:
    """Factorize a matrix with its further parts, in the pattern that was analyzed. counted: as in Factorized."""
    return factor.factorize(parts.triangle[3], *parts.low_rank, operators=parts.operators, counted=counted)


def times_low_rank(low_rank: tuple[np.ndarray, ...], vector: np.ndarray) -> np.ndarray:
    """Return the product of the sum of s u u^T with a vector, for columns u (n, k) and stiffnesses s (k,)."""
    columns, stiffnesses = low_rank
    return columns @ (stiffnesses * (columns.T @ vector))


def sum_of_low_rank(
    one: tuple[np.ndarray, ...], other: tuple[np.ndarray, ...], factor: float
) -> tuple[np.ndarray, ...]:
    """Return the columns and stiffnesses of a matrix of low rank plus a multiple of another one; () if it is zero."""
    if not other:
        return one
    if not one:
        return other[0], factor * other[1]
    if np.array_equal(one[0], other[0]):
        stiffnesses = one[1] + factor * other[1]
        return (one[0], stiffnesses) if np.any(stiffnesses) else ()
    return np.hstack([one[0], other[0]]), np.concatenate([one[1], factor * other[1]])


def times_operators(
    operators: tuple[tuple[float, _core.OperatorPart], ...], vector: np.ndarray
) -> np.ndarray:
    """Return the product of the sum of weights times operators with a vector (n,)."""
    product = np.zeros_like(vector)
    for weight, operator in operators:
        product += weight * operator.product(vector)
    return product
