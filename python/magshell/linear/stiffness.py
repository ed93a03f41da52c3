"""The stiffness of a scene at one of its states: what linear theory works with."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from .. import _core

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
        report = self._factor.factorize(values, *beside)
        if not report.succeeded or report.negative_pivots or report.perturbed_pivots:
            raise ValueError(
                f"the stiffness {where} is not positive definite ({report.negative_pivots} negative and "
                f"{report.perturbed_pivots} zero pivots of {size}), and linear theory needs that: hold the sheet by supports"
            )

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Refined once with a residual of more digits: where stiffnesses differ by 1e6, the order of elimination would
        decide what is left of the soft ones' digits."""
        solution = self._factor.solve(forces)
        left = self._factor.residual(self._values, solution, forces)
        if self._beside:
            left = left - _times(self._beside, solution)
        return solution + self._factor.solve(left)


def _analysed(size: int, starts: np.ndarray, rows: np.ndarray, points: np.ndarray) -> _core.Factor:
    return _core.analyze(size, starts, rows, points=points, ordering="amd" if size <= _SMALL else "best")


def _times(beside: tuple[np.ndarray, ...], vector: np.ndarray) -> np.ndarray:
    """The product with the sum of s u u^T, columns u (n, k) and stiffnesses s (k,)."""
    columns, stiffnesses = beside
    return columns @ (stiffnesses * (columns.T @ vector))


class Stiffness:
    """The Hessian K of a scene at a state with these controls, its core holding the values. Works on free unknowns, (n,).
    What is solved with is factorized once: the whole K, or what a load is coupled with.

    where: in words, for errors: ValueError, once something is factorized that is not positive definite.
    """

    def __init__(self, model: Any, state: np.ndarray, controls: np.ndarray, where: str):
        self._model, self._where = model, where
        self.state: np.ndarray = state
        self.controls: np.ndarray = controls
        *self._pattern, self._values = model.hessian(state, controls)
        self.gradient: np.ndarray = model.last_gradient
        columns, stiffnesses = model.low_rank()
        self._beside = (columns, stiffnesses) if np.any(stiffnesses) else ()
        self._whole: _Factorized | None = None

    @property
    def matrix(self) -> scipy.sparse.csc_array:
        """K, (n, n), without what is beside it."""
        return self.with_values(self._values)

    def with_values(self, values: np.ndarray) -> scipy.sparse.csc_array:
        """The symmetric matrix (n, n) whose lower triangle has K's pattern and these values."""
        return symmetric(*self._pattern, values)

    def negative_directions(self, change: np.ndarray) -> int:
        """How many negative eigenvalues K plus a change of its values has, by another factorization."""
        factor = _analysed(*self._pattern, self._model.free_points)
        return factor.factorize(self._values + change).negative_pivots

    def factorize(self) -> None:
        """The whole K, whatever a load is coupled with."""
        if self._whole is None:
            points = self._model.free_points
            self._whole = _Factorized(*self._pattern, self._values, points, self._where, self._beside)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """u (n,) of K u = forces (n,)."""
        self.factorize()
        return self._whole.solve(forces)

    def answer(self, forces: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """du of all unknowns, held ones included: K du = forces - K moved, with `moved` what is prescribed, both of all."""
        if moved.any():
            forces = forces - self._pull(moved)
        return moved + self._model.expand(self._answer(self._model.reduce(forces)))

    def _pull(self, moved: np.ndarray) -> np.ndarray:
        """K times a motion of all unknowns."""
        pattern = self._model.hessian(self.state, self.controls, reduced=False)
        return symmetric(*pattern) @ moved + _times(self._model.low_rank(reduced=False), moved)

    def _answer(self, forces: np.ndarray) -> np.ndarray:
        """u of K u = forces, where not even the rest of K need be regular if nothing couples it with a force: it stays at
        rest."""
        alone = self._whole is None and not self._beside
        part = _core.loaded_part(*self._pattern, self._values, forces) if alone else None
        if part is None:
            return self.solve(forces)
        unknowns, starts, rows, values = part
        points = self._model.free_points[unknowns]
        answer = np.zeros_like(forces)
        held = _Factorized(len(unknowns), starts, rows, values, points, self._where)
        answer[unknowns] = held.solve(forces[unknowns])
        return answer


def symmetric(size: int, starts: np.ndarray, rows: np.ndarray, values: np.ndarray) -> scipy.sparse.csc_array:
    """Both triangles of a matrix (n, n) whose lower one is given by columns."""
    lower = scipy.sparse.csc_array((values, rows, starts), shape=(size, size))
    diagonal = lower.diagonal()
    both = lower + lower.T
    both.setdiag(diagonal)
    return scipy.sparse.csc_array(both)
