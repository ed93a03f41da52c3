"""Gradients of the squares of frequencies about an equilibrium. Works on arrays; autograd.py has the tensors.

    K v = s M v, v . M v = 1:      ds = v . (dK - s dM) v,      dK = dK/dk dk + dK/dq dq,      K dq = -dg/dk dk

dq is the change of the equilibrium itself. One solve with K has its adjoint for all inputs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from .factorized import Factorized
from .leaf_gradient import by_leaf
from .residual import Derivatives, Residual

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs, Leaf
    from ...model.scene.values import Gradient

# Eigenvalues that differ by less, over the larger of both, are one double eigenvalue as far as derivatives can tell: its
# modes are any two of a plane, and each changes by another amount. Tested by test_double_frequencies_have_no_gradient.
_DOUBLE = 1e-6


class EigenvalueAdjoint(ABC):
    """The gradients of eigenvalues (m,), ascending, by the leaves of one or two sets of load parameters.

    leaves: each with the number of its set; `_gradient` returns a gradient for each set. inputs: those in the core.
    complete: there are no further eigenvalues. Otherwise the last one serves only to tell whether the one before is simple.
    """

    _name = "eigenvalue"

    def __init__(
        self, inputs: Inputs, eigenvalues: np.ndarray, leaves: Sequence[tuple[Leaf, int]], complete: bool
    ):
        self._inputs, self._eigenvalues, self._leaves = inputs, eigenvalues, leaves
        self._count = len(eigenvalues) if complete else len(eigenvalues) - 1
        self._found: dict[int, tuple[Gradient, ...]] = {}

    @property
    def tensors(self) -> list[object]:
        """The tensors of the leaves."""
        return [leaf.tensor for leaf, _ in self._leaves]

    @abstractmethod
    def _gradient(self, k: int) -> tuple[Gradient, ...]:
        """Return the gradients of an eigenvalue by all inputs, one for each set of load parameters."""

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients with respect to the wanted leaves of the inputs, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        # A frequency of zero is a root of zero: torch says NaN where nobody asked for it, and infinity where somebody did.
        zero = self._eigenvalues[: self._count] == 0.0
        weights = np.where(np.isnan(by_outputs[0]) & zero, 0.0, by_outputs[0])
        leaves = list(zip(self._leaves, wanted, strict=True))
        found = [np.zeros(leaf.shape) if asked else None for (leaf, _), asked in leaves]
        for k in np.flatnonzero(weights):
            if zero[k] and not np.isfinite(weights[k]):
                raise NoGradient(f"no gradient of frequency {k}, which is zero: its square has one")
            gradients = self._of(int(k))
            for n, ((leaf, part), asked) in enumerate(leaves):
                if asked:
                    found[n] = found[n] + weights[k] * by_leaf(self._inputs, leaf, gradients[part])
        return found

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of all eigenvalues along changes of all leaves.

        Raises NoGradient where there are none.
        """
        rates = np.zeros(self._count)
        for k in range(self._count if any(np.any(each) for each in along) else 0):
            rates[k] = sum(
                np.sum(by_leaf(self._inputs, leaf, self._of(k)[part]) * each)
                for (leaf, part), each in zip(self._leaves, along, strict=True)
                if np.any(each)
            )
        return [rates]

    def _of(self, k: int) -> tuple[Gradient, ...]:
        """Return the gradients of one eigenvalue, which are computed once."""
        if k not in self._found:
            self._refuse(k)
            with self._inputs.in_core():
                self._found[k] = self._gradient(k)
        return self._found[k]

    def _refuse(self, k: int) -> None:
        """Raise NoGradient if an eigenvalue is not simple."""
        for other in (k - 1, k + 1):
            if not 0 <= other < len(self._eigenvalues):
                continue
            size = max(abs(self._eigenvalues[k]), abs(self._eigenvalues[other]))
            apart = abs(self._eigenvalues[other] - self._eigenvalues[k])
            if apart <= _DOUBLE * size:
                raise NoGradient(
                    f"no gradient of {self._name} {k}: it equals {self._name} {other} to a relative "
                    f"{apart / max(size, 1e-300):.1e}. The modes of a double one mix under the smallest change, so that "
                    "neither has a derivative. Break the symmetry of the design, or hold one of the modes by a support"
                )


class FrequencyAdjoint(EigenvalueAdjoint):
    """The gradients of squares of frequencies by the inputs of the equilibrium that vibrates.

    squares: (m,) 1/s2, ascending; vectors: (size, m), their modes of all unknowns with v . M v = 1. complete: as in
        EigenvalueAdjoint.
    at_rest: the state does not depend on the inputs. consistent: the masses are not those of the vertices.
    """

    _name = "the square of frequency"

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
        super().__init__(residual.inputs, squares, [(leaf, 0) for leaf in residual.inputs.leaves], complete)
        self._residual, self._vectors = residual, vectors
        self._at_rest, self._consistent = at_rest, consistent

    def _refuse(self, k: int) -> None:
        if self._consistent:
            raise NoGradient(
                'no gradient of frequencies with mass="consistent": take mass="lumped", which has one'
            )
        super()._refuse(k)

    def _gradient(self, k: int) -> tuple[Gradient, ...]:
        model, residual = self._inputs.scene._model, self._residual
        vector = self._vectors[:, k]
        derivatives = residual.hessian_derivatives(vector, vector)
        by_masses = -self._eigenvalues[k] * (model.points(vector) ** 2).sum(axis=1)
        if self._at_rest:
            return (residual.by_inputs(derivatives.at_fixed_state(), by_masses),)
        return (residual.by_inputs(through_equilibrium(residual, derivatives), by_masses),)


def through_equilibrium(residual: Residual, derivatives: Derivatives) -> Derivatives:
    """Return the derivatives with respect to values and load parameters also through the equilibrium, which changes with
    them.

    Those by unknowns are left to what supports prescribe.
    """
    return derivatives.plus(1.0, residual.derivatives(multiplier_of(residual, derivatives.by_state)))


def multiplier_of(residual: Residual, by_state: np.ndarray) -> np.ndarray:
    """Return the solution w of K w = -by_state for the free unknowns, of all unknowns, with the stiffness K there."""
    model = residual.inputs.scene._model
    stiffness = Factorized(residual.hessian(), model.free_points, counted=False)
    return model.expand(stiffness.solve(-model.reduce(by_state)))
