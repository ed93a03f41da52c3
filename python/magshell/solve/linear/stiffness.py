"""The stiffness of a scene at one of its states, for linear theory."""

from __future__ import annotations

import functools
import threading

import numpy as np
import scipy

from ... import _core
from ...model.scene.scene import Scene
from ..adjoint.factorized import (
    Factorized,
    StiffnessParts,
    analyzed,
    factorize,
    stiffness_parts,
    sum_of_low_rank,
    times_low_rank,
)


class IndefiniteStiffness(ValueError):
    """An error for a stiffness that is not positive definite, of which linear theory has no answer."""


class _Factorized(Factorized):
    """A factorized positive definite matrix. Raises IndefiniteStiffness if it is not positive definite.

    where: the state in words, for that error.
    """

    def __init__(self, parts: StiffnessParts, points: np.ndarray, where: str):
        super().__init__(parts, points)
        refuse_indefinite(self.report, parts.triangle[0], where)


def is_positive_definite(report: _core.FactorReport) -> bool:
    """Return whether a factorization has shown that the matrix is positive definite."""
    return report.succeeded and not report.negative_pivots and not report.perturbed_pivots


def refuse_indefinite(report: _core.FactorReport, size: int, where: str) -> None:
    """Raise IndefiniteStiffness if a factorization has shown that the matrix is not positive definite."""
    if not is_positive_definite(report):
        raise IndefiniteStiffness(
            f"the stiffness {where} is not positive definite ({report.negative_pivots} negative and "
            f"{report.perturbed_pivots} zero pivots of {size}), and linear theory needs that: add supports"
        )


class Stiffness:
    """The Hessian K of a scene at a state with these load parameters, of the free degrees of freedom (n,).

    The core has to hold the values of the solve. K is assembled and factorized once, when it is first needed;
    IndefiniteStiffness if it is not positive definite then. Several threads may ask, each with a core model of its own.

    where: the state in words, for that error.
    """

    def __init__(self, scene: Scene, state: np.ndarray, load_parameters: np.ndarray, where: str):
        self._scene = scene
        self.where: str = where
        self._factorizing = threading.Lock()
        self.state: np.ndarray = state
        self.load_parameters: np.ndarray = load_parameters
        self._whole: _Factorized | None = None

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self._scene._model

    @property
    def points(self) -> np.ndarray:
        """The places of the free degrees of freedom, (n, 3) m."""
        return self._model.free_points

    @functools.cached_property
    def parts(self) -> StiffnessParts:
        """The sparse matrix K, its low-rank part and its operators, from one evaluation."""
        return stiffness_parts(self._model, self.state, self.load_parameters)

    @functools.cached_property
    def gradient(self) -> np.ndarray:
        """The gradient of the energy by all degrees of freedom."""
        return self._model.gradient(self.state, self.load_parameters)

    @property
    def matrix(self) -> scipy.sparse.csc_array:
        """The sparse matrix K without its low-rank part and its operators, (n, n)."""
        return symmetric(*self.parts.triangle)

    def with_values(self, values: np.ndarray) -> scipy.sparse.csc_array:
        """Return the symmetric matrix (n, n) whose lower triangle has the pattern of K and these nonzeros."""
        return symmetric(*self.parts.triangle[:3], values)

    def moved(self, change: StiffnessParts, factor: float) -> StiffnessParts:
        """Return K plus a multiple of a change, both without their operators."""
        *pattern, values = self.parts.triangle
        triangle = (*pattern, values + factor * change.triangle[3])
        low_rank = sum_of_low_rank(self.parts.low_rank, change.low_rank, factor)
        return self.parts._replace(triangle=triangle, low_rank=low_rank, operators=())

    def negative_directions(self, change: StiffnessParts, factor: float) -> int:
        """Count the negative eigenvalues of K plus a multiple of a change, without operators, by another factorization."""
        moved = self.moved(change, factor)
        return factorize(analyzed(*moved.triangle[:3], self.points), moved).negative_pivots

    def dense(self) -> Stiffness:
        """Return the same, not factorized, with a matrix of full pattern, which contains the operators."""
        same = Stiffness(self._scene, self.state, self.load_parameters, self.where)
        vars(same)["parts"] = self.parts.dense()
        return same

    @property
    def factorized(self) -> bool:
        """The state of K: True if the whole of it is factorized."""
        return self._whole is not None

    def factorize(self) -> None:
        """Factorize the whole of K, not only the part that is coupled with a load."""
        self._factor()

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Solve K u = forces for u, (n,)."""
        return self._factor().solve(forces)

    def _factor(self) -> _Factorized:
        with self._factorizing:
            if self._whole is None:
                self._whole = _Factorized(self.parts, self.points, self.where)
            return self._whole

    def answer(self, forces: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Solve K du = forces - K moved for du of all degrees of freedom; `moved`: the prescribed ones, else zero."""
        self.factorize()
        if moved.any():
            forces = forces - self._pull(moved)
        return moved + self._model.expand(self.solve(self._model.reduce(forces)))

    def _pull(self, moved: np.ndarray) -> np.ndarray:
        """Return K times a motion of all degrees of freedom."""
        if self.parts.operators:
            return self._model.hessian_product(self.state, self.load_parameters, moved)
        pattern = self._model.hessian(self.state, self.load_parameters, reduced=False)
        return symmetric(*pattern) @ moved + times_low_rank(self._model.low_rank(reduced=False), moved)


def symmetric(size: int, starts: np.ndarray, rows: np.ndarray, values: np.ndarray) -> scipy.sparse.csc_array:
    """Return the symmetric matrix (n, n) whose lower triangle is given by columns."""
    lower = scipy.sparse.csc_array((values, rows, starts), shape=(size, size))
    diagonal = lower.diagonal()
    both = lower + lower.T
    both.setdiag(diagonal)
    return scipy.sparse.csc_array(both)
