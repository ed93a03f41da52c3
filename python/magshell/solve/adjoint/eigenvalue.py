"""Gradients of the squares of frequencies about an equilibrium. Works on arrays; autograd.py has the tensors.

    K v = s M v, v . M v = 1:      ds = v . (dK - s dM) v,      dK = dK/dk dk + dK/dq dq,      K dq = -dg/dk dk

dq is the change of the equilibrium itself. One solve with K has its adjoint for all inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from .factorized import Factorized
from .residual import Residual, Slopes
from .static import by_leaf

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs
    from ...model.scene.values import Gradient

# Squares that differ by less, over the larger of both, belong to one double eigenvalue as far as derivatives can tell: its
# modes are any two of a plane, and each changes by another amount. Tested by test_double_frequencies_have_no_gradient.
_DOUBLE = 1e-6


class FrequencyAdjoint:
    """The gradients of squares of frequencies by the inputs of the equilibrium that vibrates.

    squares: (m,) 1/s2, ascending; vectors: (size, m), their modes of all unknowns with v . M v = 1. The last one serves only
        to tell whether the one before is simple, unless `complete`: there are no others.
    at_rest: the state does not depend on the inputs. consistent: the masses are not those of the vertices.
    """

    def __init__(
        self,
        residual: Residual,
        squares: np.ndarray,
        vectors: np.ndarray,
        *,
        complete: bool,
        at_rest: bool,
        consistent: bool,
    ):
        self._residual, self._squares, self._vectors = residual, squares, vectors
        self._count = len(squares) if complete else len(squares) - 1
        self._at_rest, self._consistent = at_rest, consistent
        self._found: dict[int, Gradient] = {}

    @property
    def inputs(self) -> Inputs:
        """The inputs of the equilibrium."""
        return self._residual.inputs

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves of the inputs, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        # A frequency of zero is a root of zero: torch says NaN where nobody asked for it, and infinity where somebody did.
        weights = np.where(
            np.isnan(by_outputs[0]) & (self._squares[: self._count] == 0.0), 0.0, by_outputs[0]
        )
        found = [
            np.zeros(leaf.shape) if asked else None
            for leaf, asked in zip(self.inputs.leaves, wanted, strict=True)
        ]
        for k in np.flatnonzero(weights):
            if self._squares[k] == 0.0 and not np.isfinite(weights[k]):
                raise NoGradient(f"no gradient of frequency {k}, which is zero: its square has one")
            gradient = self._of(int(k))
            for n, leaf in enumerate(self.inputs.leaves):
                if wanted[n]:
                    found[n] = found[n] + weights[k] * by_leaf(self.inputs, leaf, gradient)
        return found

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of the squares along changes of all leaves. Raises NoGradient where there are none."""
        rates = np.zeros(self._count)
        for k in range(self._count if any(np.any(each) for each in along) else 0):
            leaves = zip(self.inputs.leaves, along, strict=True)
            rates[k] = sum(
                np.sum(by_leaf(self.inputs, leaf, self._of(k)) * each)
                for leaf, each in leaves
                if np.any(each)
            )
        return [rates]

    def _of(self, k: int) -> Gradient:
        """Return the gradient of one square by all inputs; it is computed once."""
        if k not in self._found:
            self._refuse(k)
            with self.inputs.in_core():
                self._found[k] = self._gradient(k)
        return self._found[k]

    def _refuse(self, k: int) -> None:
        if self._consistent:
            raise NoGradient(
                'no gradient of frequencies with mass="consistent": take mass="lumped", which has one'
            )
        size = np.abs(self._squares[k])
        for other in (k - 1, k + 1):
            if not 0 <= other < len(self._squares):
                continue
            apart = abs(self._squares[other] - self._squares[k])
            if apart <= _DOUBLE * max(size, abs(self._squares[other])):
                raise NoGradient(
                    f"no gradient of the square of frequency {k}: it equals that of frequency {other} to a relative "
                    f"{apart / max(size, 1e-300):.1e}. The modes of a double frequency mix under the smallest change, so "
                    "that neither has a derivative. Break the symmetry of the design, or hold one of the modes by a support"
                )

    def _gradient(self, k: int) -> Gradient:
        model, residual = self.inputs.scene._model, self._residual
        vector = self._vectors[:, k]
        slopes = residual.bent(vector, vector)
        by_masses = -self._squares[k] * (model.points(vector) ** 2).sum(axis=1)
        if self._at_rest:
            return residual.by_inputs(Slopes(0.0 * slopes.by_state, *slopes[1:]), by_masses)
        return residual.by_inputs(through_equilibrium(residual, slopes), by_masses)


def through_equilibrium(residual: Residual, slopes: Slopes) -> Slopes:
    """Return the derivatives by values and load parameters also through the equilibrium, which changes with them.

    Those by unknowns are left to what supports prescribe.
    """
    model = residual.inputs.scene._model
    triangle, low_rank = residual.hessian()
    stiffness = Factorized(*triangle, model.free_points, low_rank)
    adjoint = model.expand(stiffness.solve(-model.reduce(slopes.by_state)))
    return slopes.plus(1.0, residual.slopes(adjoint))
