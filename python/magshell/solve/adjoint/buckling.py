"""Gradients of buckling factors of linear theory. Works on arrays; autograd.py has the tensors.

    (K + f G) v = 0,   v . G v = -1:      df = v . (dK + f dG) v
    G = K_s(u) + K_l,   K u = g(q, c) - g(q, c1)

with the state q and the load parameters c of K, and the load parameters c1 towards which these go. G is the stiffness of the
rates of stresses along the response u, and of loads (stress_stiffness.py). u depends on the inputs, and about an equilibrium
q does. Each costs one solve with K for all inputs, whose factorization the factors have left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from .eigenvalue import EigenvalueAdjoint
from .residual import Residual
from .stress_stiffness import StressStiffnessDerivatives

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Leaf
    from ...model.scene.values import Gradient

BEFORE, AFTER = 0, 1  # which load parameters a leaf belongs to: c or c1


class BucklingAdjoint(EigenvalueAdjoint):
    """The gradients of buckling factors with respect to the inputs of the state with stiffness K, and to further load
    parameters.

    residual: there. solve: with K, for the free unknowns. after: c1. response: u of all unknowns. vectors: (size, m), modes
        v of all unknowns. complete: as in EigenvalueAdjoint. leaves: each with BEFORE or AFTER. at_rest: the state does not
        depend on the inputs.
    refusal: why there is no gradient, or "".
    """

    _name = "factor"

    def __init__(
        self,
        residual: Residual,
        solve: Callable[[np.ndarray], np.ndarray],
        after: np.ndarray,
        response: np.ndarray,
        factors: np.ndarray,
        vectors: np.ndarray,
        leaves: Sequence[tuple[Leaf, int]],
        *,
        complete: bool,
        at_rest: bool,
        refusal: str = "",
    ):
        super().__init__(residual.inputs, factors, leaves, complete)
        self._residual, self._solve, self._after, self._response = residual, solve, after, response
        self._vectors, self._at_rest, self._refusal = vectors, at_rest, refusal

    def _refuse(self, k: int) -> None:
        if self._refusal:
            raise NoGradient(self._refusal)
        super()._refuse(k)

    def _gradient(self, k: int) -> tuple[Gradient, ...]:
        here, factor, response = self._residual, self._eigenvalues[k], self._response
        vector = self._vectors[:, k]
        vector = vector * np.sqrt(factor / (vector @ here.product(vector)))
        stresses = StressStiffnessDerivatives(here, self._after, response, vector)
        of_stresses, by_after = stresses.derivatives()
        total, by_after = (
            here.hessian_derivatives(vector, vector).plus(factor, of_stresses),
            factor * by_after,
        )
        multiplier = self._multiplier(factor * stresses.by_motion())
        there = here.at(here.state, self._after).derivatives(multiplier)
        total = total.plus(1.0, here.hessian_derivatives(multiplier, response)).plus(
            -1.0, here.derivatives(multiplier)
        )
        total = total.plus(1.0, there.at_fixed_load_parameters())
        by_after = by_after + there.by_load_parameters
        if self._at_rest:
            total = total.at_fixed_state()
        else:
            total = total.plus(1.0, here.derivatives(self._multiplier(total.by_state)))
        after = total.at_fixed_state()._replace(by_load_parameters=by_after)
        return here.by_inputs(total), here.by_inputs(after)

    def _multiplier(self, by_state: np.ndarray) -> np.ndarray:
        """Return the solution w of K w = -by_state for the free unknowns, of all unknowns."""
        model = self._inputs.scene._model
        return model.expand(self._solve(-model.reduce(by_state)))
