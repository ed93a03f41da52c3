"""The stiffness of the rates of stresses, for linear buckling, and its derivatives. Works on arrays.

    T = v . K_s v,      K_s = sum_i s'_i d2d_i/dq2,      s' = (d2E/dd2) J u

with the strains d of the energy E, J = dd/dq and the rates s' of the stresses as the state moves along u. With the strain
curvatures c = d2d/dq2 [v, v] and W(q) = s(q) . c, the derivatives of T are those at fixed strain rates J u, plus the rate
along u of the derivatives of W at fixed c; those by u are dW/dq.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...errors import NoGradient
from .differences import directional_derivative
from .factorized import StiffnessParts, stiffness_parts, sum_of_low_rank
from .residual import Derivatives, Residual

if TYPE_CHECKING:
    from collections.abc import Sequence


@contextlib.contextmanager
def frozen_stress_rates(
    model: _core.Model, state: np.ndarray, load_parameters: np.ndarray, motion: np.ndarray | None
) -> Iterator[None]:
    """Hold the stresses of a model at their rates along a motion from a state, or at zero.

    Meanwhile forces and Hessians, at any state, are those of these stresses and of the loads.
    """
    _core.freeze_stress_rates(model, state, load_parameters, motion)
    try:
        yield
    finally:
        _core.release_stresses(model)


def stress_stiffness(
    model: _core.Model,
    state: np.ndarray,
    load_parameters: np.ndarray,
    motion: np.ndarray,
    load_parameters_after: np.ndarray,
) -> StiffnessParts:
    """Return the stiffness of the rates of stresses along a motion, plus the change of the stiffness of loads and fields at
    the fixed state, in the pattern of the Hessian there.
    """
    with frozen_stress_rates(model, state, load_parameters, motion):
        after = stiffness_parts(model, state, load_parameters_after)
    with frozen_stress_rates(model, state, load_parameters, None):
        before = stiffness_parts(model, state, load_parameters)
    values = after.triangle[3] - before.triangle[3]
    operators = (*after.operators, *((-weight, operator) for weight, operator in before.operators))
    low_rank = sum_of_low_rank(after.low_rank, before.low_rank, -1.0)
    return StiffnessParts((*after.triangle[:3], values), low_rank, operators)


class StressStiffnessDerivatives:
    """The derivatives of v . (K_s + K_l) v, with the stiffness K_l of loads that `stress_stiffness` has.

    residual: at the state, with its load parameters. after: the other ones. motion: u; vector: v, both of all unknowns. The
    core must hold the values of the inputs. Raises NoGradient where the forces are not smooth, and for energies whose
    stress rates have no derivatives.
    """

    def __init__(self, residual: Residual, after: np.ndarray, motion: np.ndarray, vector: np.ndarray):
        self._here, self._after, self._motion, self._vector = residual, after, motion, vector
        if names := _core.without_stress_work_vjp(self._model):
            raise NoGradient(
                f"no gradient of buckling factors with the changing stresses of: {', '.join(dict.fromkeys(names))}"
            )
        self._curvatures: list[np.ndarray] = self._strain_curvatures()

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self._here.inputs.scene._model

    def by_motion(self) -> np.ndarray:
        """Return the derivatives by u, of all unknowns."""
        return self._by_stresses(0.0).by_state

    def derivatives(self) -> tuple[Derivatives, np.ndarray]:
        """Return the derivatives at a fixed u: by everything with the load parameters of the state, and by the others."""
        here, vector = self._here, self._vector
        here.gradient()  # sets the branches of angles
        with self._held(self._motion):
            after = here.at(here.state, self._after).hessian_derivatives(vector, vector)
        with self._held(None):
            before = here.hessian_derivatives(vector, vector)
        found = after.at_fixed_load_parameters().plus(-1.0, before)
        return found.plus(1.0, here.rates(self._by_stresses, self._motion)), after.by_load_parameters

    def _held(self, motion: np.ndarray | None) -> contextlib.AbstractContextManager[None]:
        return frozen_stress_rates(self._model, self._here.state, self._here.load_parameters, motion)

    def _by_stresses(self, step: float) -> Derivatives:
        """Return the derivatives of W at the state plus a multiple of u."""
        here = self._here
        here.gradient()
        state = here.state + step * self._motion
        return Derivatives(
            *_core.stress_work_vjp(self._model, state, here.load_parameters, self._curvatures, here.with_rest)
        )

    def _strain_curvatures(self) -> list[np.ndarray]:
        """Return c of each energy: the rates along v of the strain rates along v."""
        here, vector = self._here, self._vector
        sizes: list[int] = []

        def at(step: float) -> np.ndarray:
            here.gradient()
            state = here.state + step * vector
            rates = _core.strain_rates(self._model, state, here.load_parameters, vector)
            sizes[:] = [len(each) for each in rates]
            return _rows(rates)

        found = directional_derivative(at, here.steps(vector))
        if found is None:
            raise NoGradient("no gradient here: the strains are not smooth at this state")
        return [row[:size] for row, size in zip(found, sizes, strict=True)]


def _rows(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays as rows, filled up with zeros."""
    rows = np.zeros((len(parts), max((len(part) for part in parts), default=0)))
    for row, part in zip(rows, parts, strict=True):
        row[: len(part)] = part
    return rows
