"""Gradients of critical points of paths of equilibria. Works on arrays; autograd.py has the tensors.

A critical point solves  g(q, s, k) = 0,  v . K(q, s, k) v = 0,  with K v = 0 and the path parameter s. Its gradient by all
inputs k is one product mu . dg/dk + eta (v . dK/dk v), with multipliers that solve the transposed system:

    limit point              of s:    mu = -v / (v . dg/ds),   eta = 0
                             of q:    eta = -(v . y) / T,   K mu = -(y + eta dK),   mu . dg/ds + eta dK/ds = 0
    symmetric bifurcation    of both: eta from mu . dg/ds + eta dK/ds = -y_s,   K mu = -(y + eta dK),   T = v . dg/ds = 0

with y by q and y_s by s, dK = d(v . K v)/dq and T = dK . v.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from ...model.scene.reshaped import REST
from ...model.scene.values import Gradient
from .critical_system import CriticalSystem, Located, forces_and_prescribed
from .differences import directional_derivative
from .energy import Unknowns
from .leaf_gradient import by_leaf
from .residual import Derivatives
from .tangent import changed, steps_along

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs, Leaf

# Largest cosine (1) between the mode and a force at a symmetric bifurcation, which is zero up to round-off of the symmetry.
# Tested by test_inputs_that_break_the_symmetry_of_a_bifurcation_have_no_gradient.
_ACROSS = 1e-6


class CriticalAdjoint:
    """The gradients of the parameter and of the positions of a critical point with respect to the inputs of its path.

    of_start: leaves of the equilibrium at which the path starts, on which its first load parameters depend.
    refusal: why there is no gradient, or "".
    """

    def __init__(
        self, inputs: Inputs, point: Located | None, of_start: Sequence[Leaf] = (), refusal: str = ""
    ):
        self._inputs, self._point, self._of_start, self._refusal = inputs, point, of_start, refusal

    @property
    def tensors(self) -> list[object]:
        """The tensors of all leaves."""
        return [*self._inputs.tensors, *(leaf.tensor for leaf in self._of_start)]

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        by_parameter, by_positions = by_outputs
        inputs = self._inputs
        if not (np.any(by_parameter) or np.any(by_positions)):
            leaves = zip(self._leaves, wanted, strict=True)
            return [np.zeros(leaf.shape) if asked else None for (leaf, _), asked in leaves]
        if self._refusal:
            raise NoGradient(self._refusal)
        with inputs.in_core():
            system = self._system
            by_state = self._by_state(by_positions)
            if self._point.kind == "limit":
                derivatives = _of_limit(system, float(by_parameter), by_state)
            else:
                self._refuse_asymmetric(system)
                self._refuse_what_dissolves(system, wanted)
                derivatives = _of_bifurcation(system, float(by_parameter), by_state)
            total = system.residual.by_inputs(derivatives)
        return [
            by_leaf(inputs, leaf, _scaled(inputs, total, fraction)) if asked else None
            for (leaf, fraction), asked in zip(self._leaves, wanted, strict=True)
        ]

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of the parameter and of the positions along changes of all leaves.

        Raises NoGradient where there are none.
        """
        model = self._inputs.scene._model
        if not any(np.any(each) for each in along):
            return [np.zeros(()), model.positions(np.zeros(model.size))]
        if self._refusal:
            raise NoGradient(self._refusal)
        with self._inputs.in_core():
            system = self._system
            forces, held, eigenvalue_change = np.zeros(model.free_size), np.zeros(model.size), 0.0
            for (leaf, fraction), change in zip(self._leaves, along, strict=True):
                if not np.any(change):
                    continue
                rates = self._rates(system, leaf, fraction, change)
                forces, held = forces + rates[0], held + rates[1]
                by_values = Gradient(
                    self._inputs.scene,
                    system.eigenvalue_derivatives.by_values,
                    fraction * system.eigenvalue_derivatives.by_load_parameters,
                )
                eigenvalue_change += float(np.sum(by_leaf(self._inputs, leaf, by_values) * change))
            eigenvalue_change += float(system.eigenvalue_derivatives.by_state @ held)
            if self._point.kind == "limit":
                rate, motion = _motion_of_limit(system, forces, eigenvalue_change)
            else:
                self._refuse_asymmetric(system)
                if system.alignment(forces) > _ACROSS:
                    raise NoGradient(_DISSOLVES.format("along this change"))
                rate, motion = _motion_of_bifurcation(system, forces, eigenvalue_change)
            change = model.expand(motion) + held + rate * system.rates[1]
        return [np.array(rate), np.ascontiguousarray(model.positions(change))]

    @cached_property
    def _system(self) -> CriticalSystem:
        return self._point.system()

    def _by_state(self, by_positions: np.ndarray) -> np.ndarray:
        scene = self._inputs.scene
        if not np.any(by_positions):
            return np.zeros(scene._model.size)
        unknowns = Unknowns("follow_path", scene)
        by_all = np.zeros(unknowns.gathered.shape[0])
        by_all[: unknowns.n_positions] = by_positions.ravel()
        return unknowns.gathered.T @ by_all

    @property
    def _leaves(self) -> list[tuple[Leaf, float]]:
        """Return all leaves, with the fraction that load parameters at their end of the path have in those of the point."""
        fraction = self._point.parameter if self._point is not None else 0.0
        return [
            *((leaf, fraction) for leaf in self._inputs.leaves),
            *((leaf, 1.0 - fraction) for leaf in self._of_start),
        ]

    def _refuse_asymmetric(self, system: CriticalSystem) -> None:
        by_state = self._inputs.scene._model.reduce(system.eigenvalue_derivatives.by_state)
        if system.alignment(system.rates[0]) > _ACROSS or system.alignment(by_state) > _ACROSS:
            raise NoGradient(
                "no gradient here: the bifurcation is not symmetric (its two sides differ, or loads push along its mode), "
                "and may dissolve under the smallest change. Use a mesh with the symmetry of the scene, or give the scene "
                "an imperfection, which leaves a limit point"
            )

    def _refuse_what_dissolves(self, system: CriticalSystem, wanted: Sequence[bool]) -> None:
        """Raise NoGradient if a change of a wanted leaf pushes along the mode of a bifurcation, in its steepest way."""
        total = system.residual.by_inputs(system.residual.derivatives(system.vector))
        for (leaf, fraction), asked in zip(self._leaves, wanted, strict=True):
            if not asked:
                continue
            across = by_leaf(self._inputs, leaf, _scaled(self._inputs, total, fraction))
            if not np.any(across):
                continue
            steepest = across / np.linalg.norm(across)
            if system.alignment(self._rates(system, leaf, fraction, steepest)[0]) > _ACROSS:
                raise NoGradient(_DISSOLVES.format(f"by {leaf.name}"))

    def _rates(
        self, system: CriticalSystem, leaf: Leaf, fraction: float, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the rate of g of the free unknowns along a change of a leaf, and the motion of what supports prescribe."""
        inputs, model = self._inputs, self._inputs.scene._model
        now = system.residual.load_parameters
        if leaf.owner is not None and leaf.name == REST:
            raise NoGradient(
                f"no gradient by {REST} of a bifurcation, and no tangent of a path: only limit points have gradients by them"
            )

        def at(step: float) -> np.ndarray:
            numbers, after = changed(inputs, leaf, step * change)
            model.set_values(numbers)
            return forces_and_prescribed(
                model, system.residual.state, now + fraction * (after - inputs.load_parameters)
            )

        try:
            rates = directional_derivative(at, steps_along(inputs, leaf, change))
        finally:
            model.set_values(inputs.values.numbers)
        return system.completed(rates)


_DISSOLVES = (
    "no gradient {} here: such a change pushes along the mode of the bifurcation, which dissolves then; near it, the "
    "critical value changes as the power 2/3 of an imperfection. Numbers that keep the symmetry have a gradient; through "
    "arrays that keep it, use forward mode (torch.func.jvp, jacfwd)"
)


def _scaled(inputs: Inputs, gradient: Gradient, fraction: float) -> Gradient:
    """Return a gradient with the fraction of the load parameters there that an input at one end of the path has."""
    by_load_parameters = fraction * gradient.of_load_parameters(slice(None))
    return Gradient(inputs.scene, gradient.of_values, by_load_parameters, rest=gradient.rest)


def _of_limit(system: CriticalSystem, by_parameter: float, by_state: np.ndarray) -> Derivatives:
    """Return the derivatives of a function of the parameter and the state of a limit point, with these derivatives."""
    model = system.residual.inputs.scene._model
    rate, held = system.rates
    push = float(system.null @ rate)
    total = by_parameter + float(by_state @ held)
    if not by_state.any():
        return system.residual.derivatives(system.vector * (-total / push))
    turn = float(system.eigenvalue_derivatives.by_state @ system.vector)
    eta = -float(by_state @ system.vector) / turn
    by_state = by_state + eta * system.eigenvalue_derivatives.by_state
    particular = system.solve(-model.reduce(by_state))
    total = total + float(particular @ rate) + eta * system.eigenvalue_rate
    multiplier = model.expand(particular - (total / push) * system.null)
    return _with_state(system, by_state, multiplier, eta)


def _motion_of_limit(
    system: CriticalSystem, forces: np.ndarray, eigenvalue_change: float
) -> tuple[float, np.ndarray]:
    """Return the derivatives of the parameter and of the free unknowns where dg and d(v . K v) are these."""
    rate = -float(system.null @ forces) / float(system.null @ system.rates[0])
    motion = system.solve(-(forces + rate * system.rates[0]))
    by_state = system.residual.inputs.scene._model.reduce(system.eigenvalue_derivatives.by_state)
    left = eigenvalue_change + float(by_state @ motion) + rate * system.eigenvalue_rate
    return rate, motion - system.null * left / float(by_state @ system.null)


def _of_bifurcation(system: CriticalSystem, by_parameter: float, by_state: np.ndarray) -> Derivatives:
    """Return the derivatives of a function of the parameter and the state of a symmetric bifurcation."""
    model = system.residual.inputs.scene._model
    rate, held = system.rates
    by_state = by_state - system.vector * (by_state @ system.vector) / (system.null @ system.null)
    along = system.solve(-rate)
    total = by_parameter + float(by_state @ held) + float(model.reduce(by_state) @ along)
    eta = -total / float(
        model.reduce(system.eigenvalue_derivatives.by_state) @ along + system.eigenvalue_rate
    )
    by_state = by_state + eta * system.eigenvalue_derivatives.by_state
    return _with_state(system, by_state, model.expand(system.solve(-model.reduce(by_state))), eta)


def _motion_of_bifurcation(
    system: CriticalSystem, forces: np.ndarray, eigenvalue_change: float
) -> tuple[float, np.ndarray]:
    """Return the derivatives of the parameter and of the free unknowns where dg and d(v . K v) are these."""
    motion, along = system.solve(-forces), system.solve(-system.rates[0])
    by_state = system.residual.inputs.scene._model.reduce(system.eigenvalue_derivatives.by_state)
    rate = -(eigenvalue_change + float(by_state @ motion)) / (
        float(by_state @ along) + system.eigenvalue_rate
    )
    motion = motion + rate * along
    return rate, motion - system.null * (system.null @ motion) / (system.null @ system.null)


def _with_state(
    system: CriticalSystem, by_state: np.ndarray, multiplier: np.ndarray, eta: float
) -> Derivatives:
    """Return the derivatives of multiplier . g + eta v . K v, and those by the state that were given in addition."""
    found = system.residual.derivatives(multiplier)
    return found.plus(eta, system.eigenvalue_derivatives)._replace(by_state=found.by_state + by_state)
