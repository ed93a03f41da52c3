"""The stiffness of a scene at one of its states: what linear theory works with."""

from __future__ import annotations

import functools

import numpy as np
import scipy

from ... import _core

_SMALL = 20000  # unknowns, for which the better of two orderings takes longer than it saves one factorization


class _Factorized:
    """A positive definite matrix, given as to _core.analyze, with what is `beside` it. Raises ValueError elsewhere."""

    def __init__(
        self,
        size: int,
        starts: np.ndarray,
        rows: np.ndarray,
        values: np.ndarray,
        points: np.ndarray,
        where: str,
        beside: tuple[np.ndarray, ...] = (),
    ):
        self._values, self._beside = values, beside
        self._factor = _analysed(size, starts, rows, points)
        refuse_indefinite(self._factor.factorize(values, *beside), size, where)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Refined once with a residual of more digits: where stiffnesses differ by 1e6, the order of elimination would
        decide what is left of the soft ones' digits."""
        solution = self._factor.solve(forces)
        left = self._factor.residual(self._values, solution, forces)
        if self._beside:
            left = left - _times(self._beside, solution)
        return solution + self._factor.solve(left)


def refuse_indefinite(report: _core.FactorReport, size: int, where: str) -> None:
    """Raises ValueError where a factorization has shown that."""
    if not report.succeeded or report.negative_pivots or report.perturbed_pivots:
        raise ValueError(
            f"the stiffness {where} is not positive definite ({report.negative_pivots} negative and "
            f"{report.perturbed_pivots} zero pivots of {size}), and linear theory needs that: add supports"
        )


def _analysed(size: int, starts: np.ndarray, rows: np.ndarray, points: np.ndarray) -> _core.Factor:
    return _core.analyze(size, starts, rows, points=points, ordering="amd" if size <= _SMALL else "best")


def _times(beside: tuple[np.ndarray, ...], vector: np.ndarray) -> np.ndarray:
    """The product with the sum of s u u^T, columns u (n, k) and stiffnesses s (k,)."""
    columns, stiffnesses = beside
    return columns @ (stiffnesses * (columns.T @ vector))


class Stiffness:
    """The Hessian K of a scene at a state with these controls, its core holding the values. Works on free unknowns, (n,).
    The whole of it is assembled and factorized once, if it is asked for.

    where: in words, for errors: ValueError, once something is factorized that is not positive definite.
    """

    def __init__(self, model: _core.Model, state: np.ndarray, controls: np.ndarray, where: str):
        self._model, self._where = model, where
        self.state: np.ndarray = state
        self.controls: np.ndarray = controls
        self._whole: _Factorized | None = None

    @property
    def _triangle(self) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
        """Size, starts, rows and values of the lower one."""
        return self._assembled[0]

    @functools.cached_property
    def _assembled(self) -> tuple[tuple[int, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, ...]]:
        """The lower triangle and what is beside it: both of one evaluation."""
        triangle = self._model.hessian(self.state, self.controls)
        columns, stiffnesses = self._model.low_rank()
        return triangle, ((columns, stiffnesses) if np.any(stiffnesses) else ())

    @functools.cached_property
    def gradient(self) -> np.ndarray:
        """Of all unknowns."""
        return self._model.gradient(self.state, self.controls)

    @property
    def matrix(self) -> scipy.sparse.csc_array:
        """K, (n, n), without what is beside it."""
        return symmetric(*self._triangle)

    def with_values(self, values: np.ndarray) -> scipy.sparse.csc_array:
        """The symmetric matrix (n, n) whose lower triangle has K's pattern and these values."""
        return symmetric(*self._triangle[:3], values)

    def negative_directions(self, change: np.ndarray) -> int:
        """How many negative eigenvalues K plus a change of its values has, by another factorization."""
        *pattern, values = self._triangle
        return _analysed(*pattern, self._model.free_points).factorize(values + change).negative_pivots

    @property
    def factorized(self) -> bool:
        """Whether the whole K is."""
        return self._whole is not None

    def factorize(self) -> None:
        """The whole K, whatever a load is coupled with."""
        if self._whole is None:
            triangle, beside = self._assembled
            self._whole = _Factorized(*triangle, self._model.free_points, self._where, beside)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """u (n,) of K u = forces (n,)."""
        self.factorize()
        return self._whole.solve(forces)

    def answer(self, forces: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """du of all unknowns, held ones included: K du = forces - K moved, with `moved` what is prescribed, both of all."""
        self.factorize()
        if moved.any():
            forces = forces - self._pull(moved)
        return moved + self._model.expand(self.solve(self._model.reduce(forces)))

    def _pull(self, moved: np.ndarray) -> np.ndarray:
        """K times a motion of all unknowns."""
        pattern = self._model.hessian(self.state, self.controls, reduced=False)
        return symmetric(*pattern) @ moved + _times(self._model.low_rank(reduced=False), moved)


def symmetric(size: int, starts: np.ndarray, rows: np.ndarray, values: np.ndarray) -> scipy.sparse.csc_array:
    """Both triangles of a matrix (n, n) whose lower one is given by columns."""
    lower = scipy.sparse.csc_array((values, rows, starts), shape=(size, size))
    diagonal = lower.diagonal()
    both = lower + lower.T
    both.setdiag(diagonal)
    return scipy.sparse.csc_array(both)
