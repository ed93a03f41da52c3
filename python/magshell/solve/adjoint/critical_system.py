"""The extended system of a critical point of a path, and Newton's method on it. Works on arrays.

    g(q, s) = 0,  v . K(q, s) v = 0   with K v = 0

K is singular at its solution. K plus one entry on its diagonal is factorized in its place: where v . r = 0, solving with it
gives the solution of K w = r whose entry there is zero; of the unit vector of that entry, it gives v.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...errors import NoGradient
from .differences import directional_derivative
from .factorized import Factorized
from .residual import Derivatives, Residual

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs

# The first step of the path parameter (1), and the fractions (1) of it that are tried until differences settle. Tested by
# test_critical_fields_have_the_gradients_of_differences_of_whole_paths.
_STEP, _SHORTER = 1 / 64, (1.0, 1e-1, 1e-2, 1e-3, 1e-4)
# A point is located when Newton's method changes the parameter by less (1) and moves no vertex by more (1, over the size of
# the mesh); and where it stops anyway. Tested by test_critical_points_are_located_to_eight_digits.
_LOCATED, _MOVED, _FINEST, _ITERATIONS = 1e-9, 1e-6, 1e-13, 8


class Line:
    """The load parameters along a path, (1 - s) before + s after."""

    def __init__(self, before: np.ndarray, after: np.ndarray):
        self.before: np.ndarray = before
        self.after: np.ndarray = after

    def at(self, parameter: float) -> np.ndarray:
        return (1.0 - parameter) * self.before + parameter * self.after


class CriticalSystem:
    """The stiffness K near a critical point, bordered so that it can be inverted, its null vector, and dg/ds.

    mode: about the null vector, of all unknowns. The core must hold the values.
    """

    def __init__(self, residual: Residual, line: Line, parameter: float, mode: np.ndarray):
        self.residual: Residual = residual
        self.line: Line = line
        self.parameter: float = parameter
        self._model = residual.inputs.scene._model
        parts = residual.hessian()
        size, starts, rows, numbers = parts.triangle
        diagonal = starts[:-1]
        guess, numbers = self._model.reduce(mode), numbers.copy()
        self.pinned: int = int(np.argmax(guess**2 * np.abs(numbers[diagonal])))
        added = np.abs(numbers[diagonal][self.pinned])
        numbers[diagonal[self.pinned]] += added
        pinned = parts._replace(triangle=(size, starts, rows, numbers))
        self._factor = Factorized(pinned, self._model.free_points)
        unit = np.zeros(size)
        unit[self.pinned] = 1.0
        self.response: np.ndarray = self._factor.solve(unit)
        self.null: np.ndarray = self.response / self.response[self.pinned]
        self.excess: float = (1.0 - added * self.response[self.pinned]) / self.response[
            self.pinned
        ]  # v . K v
        self.vector: np.ndarray = self._model.expand(self.null)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Solve K w = forces of the free unknowns, with the pinned entry of w zero if v . forces = 0."""
        return self._factor.solve(forces)

    @cached_property
    def rates(self) -> tuple[np.ndarray, np.ndarray]:
        """The rate dg/ds of the free unknowns along the path, and the motion of all unknowns that supports prescribe."""

        def at(step: float) -> np.ndarray:
            load_parameters = self.line.at(self.parameter + step)
            return forces_and_prescribed(self._model, self.residual.state, load_parameters)

        return self.completed(directional_derivative(at, [_STEP * each for each in _SHORTER]))

    def completed(self, rates: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Return the rate of g of the free unknowns, with what prescribed motions pull, and these motions."""
        if rates is None:
            raise NoGradient("no gradient here: the forces are not smooth at the critical point")
        forces, held = rates
        if held.any():
            forces = forces + self.residual.derivatives(held).by_state
        return self._model.reduce(forces), held

    @cached_property
    def eigenvalue_derivatives(self) -> Derivatives:
        """The derivatives of v . K v at a fixed v."""
        return self.residual.hessian_derivatives(self.vector, self.vector)

    @property
    def eigenvalue_rate(self) -> float:
        """The derivative of v . K v by the path parameter, at fixed free unknowns."""
        rate = self.line.after - self.line.before
        return float(
            self.eigenvalue_derivatives.by_load_parameters @ rate
            + self.eigenvalue_derivatives.by_state @ self.rates[1]
        )

    def alignment(self, forces: np.ndarray) -> float:
        """Return the cosine between the mode and forces, 0 if these vanish."""
        sizes = np.linalg.norm(forces) * np.linalg.norm(self.null)
        return float(abs(forces @ self.null) / sizes) if sizes > 0.0 else 0.0


class Located:
    """A critical point that Newton's method on the extended system has located, from about there.

    state: all unknowns. parameter: of the path. problem: why it could not be located, else "".
    """

    def __init__(
        self,
        inputs: Inputs,
        line: Line,
        kind: str,
        state: np.ndarray,
        angle_branches: list[list[float]],
        parameter: float,
        mode: np.ndarray,
    ):
        self.inputs: Inputs = inputs
        self.line: Line = line
        self.kind: str = kind
        self.state: np.ndarray = state
        self.parameter: float = parameter
        self.problem: str = ""
        self._angle_branches, self._mode = angle_branches, mode
        try:
            with inputs.in_core():
                self._improve()
        except NoGradient as error:
            self.problem = str(error)
        except np.linalg.LinAlgError:
            self.problem = "no gradient here: the critical point is not simple"

    def system(self) -> CriticalSystem:
        """Return the system there; the core must hold the values."""
        load_parameters = self.line.at(self.parameter)
        residual = Residual(self.inputs, self.state, self._angle_branches, load_parameters)
        return CriticalSystem(residual, self.line, self.parameter, self._mode)

    def _improve(self) -> None:
        model, extent = self.inputs.scene._model, self.inputs.scene._bodies.extent
        smallest = np.inf
        for _ in range(_ITERATIONS):
            change, motion = self._step(self.system())
            size = float(np.abs(model.points(motion)).max(initial=0.0)) / extent
            relative = abs(change) / max(abs(self.parameter), 1e-3)
            if not np.isfinite(size + relative) or size > 0.1:
                break
            self.parameter += change
            self.state = self.state + motion
            self.state = self.state + model.driven_increment(self.state, self.line.at(self.parameter))
            if max(size, relative) <= _FINEST or (
                relative <= _LOCATED and size <= _MOVED and size > 0.5 * smallest
            ):
                return
            smallest = min(smallest, size)
        if not (relative <= _LOCATED and size <= _MOVED):
            raise NoGradient(
                "no gradient here: Newton's method did not locate the critical point; another one may be near it, or a "
                "contact opens or closes there"
            )

    def _step(self, system: CriticalSystem) -> tuple[float, np.ndarray]:
        """Return the change of the parameter and of all unknowns by one step of Newton's method."""
        model = self.inputs.scene._model
        rate, held = system.rates
        back = system.solve(-model.reduce(system.residual.gradient()))
        along = system.solve(-rate)
        by_state = model.reduce(system.eigenvalue_derivatives.by_state)
        if self.kind == "limit":
            k, slid = system.pinned, system.excess * system.response
            matrix = np.array(
                [
                    [-slid[k], along[k]],
                    [by_state @ (system.null - slid), by_state @ along + system.eigenvalue_rate],
                ]
            )
            share, change = np.linalg.solve(matrix, [-back[k], -system.excess - by_state @ back])
            motion = share * (system.null - slid) + back + change * along
        else:
            change = -(system.excess + by_state @ back) / (by_state @ along + system.eigenvalue_rate)
            motion = back + change * along
        return float(change), model.expand(motion) + change * held


def forces_and_prescribed(model: _core.Model, state: np.ndarray, load_parameters: np.ndarray) -> np.ndarray:
    """Return g and the increments to what supports prescribe, both of all unknowns, (2, n)."""
    return np.stack([model.gradient(state, load_parameters), model.driven_increment(state, load_parameters)])
