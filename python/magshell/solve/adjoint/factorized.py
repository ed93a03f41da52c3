"""Factorizes stiffness matrices, and solves with them to more digits than a factorization alone gives."""

from __future__ import annotations

import numpy as np

from ... import _core

_SMALL = 20000  # degrees of freedom, up to which trying two orderings costs more than the better one saves


class Factorized:
    """A factorized symmetric matrix, given as to _core.analyze, plus a low-rank part.

    report: of the factorization.
    """

    def __init__(
        self,
        size: int,
        starts: np.ndarray,
        rows: np.ndarray,
        values: np.ndarray,
        points: np.ndarray,
        low_rank: tuple[np.ndarray, ...] = (),
    ):
        self._values, self._low_rank = values, low_rank
        self._factor = analyzed(size, starts, rows, points)
        self.report: _core.FactorReport = self._factor.factorize(values, *low_rank)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Solve, with one refinement by a residual of more digits.

        Without it, where stiffnesses differ by 1e6, the digits of the soft ones would depend on the order of elimination.
        """
        solution = self._factor.solve(forces)
        left = self._factor.residual(self._values, solution, forces)
        if self._low_rank:
            left = left - times_low_rank(self._low_rank, solution)
        return solution + self._factor.solve(left)


def analyzed(size: int, starts: np.ndarray, rows: np.ndarray, points: np.ndarray) -> _core.Factor:
    """Return the symbolic factorization of a matrix of which the lower triangle has these places."""
    return _core.analyze(size, starts, rows, points=points, ordering="amd" if size <= _SMALL else "best")


def times_low_rank(low_rank: tuple[np.ndarray, ...], vector: np.ndarray) -> np.ndarray:
    """Return the product of the sum of s u u^T with a vector, for columns u (n, k) and stiffnesses s (k,)."""
    columns, stiffnesses = low_rank
    return columns @ (stiffnesses * (columns.T @ vector))
