"""Computes derivatives of a linear response, backwards (gradients) and forwards (tangents). autograd.py has the tensors.

    K u = f on the free unknowns,      u = m on those that supports hold
    f = g(q, c) - g(q, c1),            m = (s1 - s) dx/ds

g is the gradient of the energy at the state q, c the load parameters of K, c1 those of the response. s and s1 are the
factors of the supports among them, and x(s) are the positions that supports prescribe. With susceptible shells, whose energy
is quadratic in the field, f = (g(q, 2 c - c1) - g(q, c1)) / 2. For weights y of u, and the adjoint a:

    gradient:      d(y . u) = a . (df - dK u) + (y - K a) . dm,      K a = y on the free unknowns, a = 0 elsewhere
    tangent:       K du = df - dK u on the free unknowns,            du = dm elsewhere

About an equilibrium q changes with the inputs as well, which costs one more solve with K.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import NoGradient
from ...model.scene.reshaped import REST
from .buckling import AFTER, BEFORE
from .curvature import rows_of
from .differences import directional_derivative
from .energy import Unknowns
from .leaf_gradient import by_leaf
from .residual import Residual
from .tangent import changed, steps_along, steps_by_rest, values_in_neighbour

if TYPE_CHECKING:
    from ... import _core
    from ...model.scene.solve_inputs import Inputs, Leaf
    from ...model.scene.values import Gradient

# [-] Steps of differences by the support factor; the prescribed positions are smooth in it. Tested by
# test_responses_to_supports_that_turn_have_the_derivatives_of_differences.
_STEPS = (1 / 16, 1 / 64, 1e-3, 1e-4)
# [-] Largest residual of a solve with K over the largest force. A K that is singular up to round-off, and whose pivots do
# not show it, leaves more. Tested by test_solves_that_leave_forces_have_no_derivatives.
_LEFT = 1e-6


class _Load(NamedTuple):
    """Holds one term of f, weight g(q, before c + after c1)."""

    weight: float
    before: float
    after: float

    def load_parameters(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the load parameters before c + after c1."""
        return self.before * before + self.after * after


_LINEAR = (_Load(1.0, 1.0, 0.0), _Load(-1.0, 0.0, 1.0))
_QUADRATIC = (_Load(0.5, 2.0, -1.0), _Load(-0.5, 0.0, 1.0))  # a central difference, of a susceptible shell


class ResponseAdjoint:
    """Differentiates the positions and edge rotations of a linear response.

    residual: at the state of K. inputs: those of the response, with c1. response: u of all unknowns. solve: with K, for the
    free unknowns; raises ValueError if K is not positive definite. leaves: each with BEFORE or AFTER: whether it acts on c
    or on c1. at_rest: the state does not depend on the inputs. quadratic: f is the central difference of g.
    refusal: why there are no derivatives, or "".
    """

    def __init__(
        self,
        residual: Residual,
        inputs: Inputs,
        response: np.ndarray,
        solve: Callable[[np.ndarray], np.ndarray],
        leaves: Sequence[tuple[Leaf, int]],
        *,
        at_rest: bool,
        quadratic: bool,
        refusal: str = "",
    ):
        self._here, self._after, self._response, self._refusal = residual, inputs, response, refusal
        self._solve, self._leaves, self._at_rest = solve, leaves, at_rest
        self._loads = _QUADRATIC if quadratic else _LINEAR
        layout = inputs.scene._load_parameter_layout
        of_supports = layout.of(np.arange(layout.size), "scene", "support_factor")
        self._support_factor = int(np.ravel(of_supports)[0])

    @property
    def _model(self) -> _core.Model:
        """The model of the core that this thread uses."""
        return self._after.scene._model

    @property
    def tensors(self) -> list[object]:
        """The tensors of the leaves."""
        return [leaf.tensor for leaf, _ in self._leaves]

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        here = self._here
        asked = [
            (leaf, part) if is_asked else None
            for (leaf, part), is_asked in zip(self._leaves, wanted, strict=True)
        ]
        with here.inputs.in_core():
            self._refuse([each[0] for each in asked if each is not None])
            weights = Unknowns("linear_response", here.inputs.scene).gathered.T @ np.concatenate(
                [each.ravel() for each in by_outputs]
            )
            by_sets = self._gradient(weights)
        return [None if each is None else by_leaf(here.inputs, each[0], by_sets[each[1]]) for each in asked]

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of positions and edge rotations along changes of all leaves.

        Raises NoGradient where there are none.
        """
        here, model = self._here, self._model
        changes = [
            (leaf, part, change)
            for (leaf, part), change in zip(self._leaves, along, strict=True)
            if np.any(change)
        ]
        with here.inputs.in_core():
            self._refuse([leaf for leaf, _, _ in changes])
            motion = self._tangent(changes) if changes else np.zeros(model.size)
        return [np.ascontiguousarray(model.positions(motion)), model.edge_rotations(motion)]

    def _refuse(self, leaves: Sequence[Leaf]) -> None:
        """Raise NoGradient where there is no derivative by one of these leaves."""
        if self._refusal:
            raise NoGradient(self._refusal)
        self._here.gradient()  # refuses scenes with rigid bodies
        for leaf in leaves:
            if leaf.refusal:
                raise NoGradient(f"no derivative by {leaf.name}: {leaf.refusal}")
            if leaf.name == REST and leaf.owner is not None and self._supports_rotate():
                raise NoGradient(
                    f"no derivative of a linear response by {REST} where supports rotate: let them stand, or detach it"
                )

    def _supports_rotate(self) -> bool:
        """Return whether supports rotate what they hold."""
        return any(np.any(move.rotation) for move in self._here.inputs.values.constraints.moves)

    @property
    def _rate(self) -> np.ndarray:
        """The rate dx/ds of all unknowns, by the factor of supports."""
        return self._model.prescribed_rate(self._here.load_parameters)

    @property
    def _further(self) -> float:
        """The change s1 - s of the factor of supports."""
        return float(
            self._after.load_parameters[self._support_factor]
            - self._here.load_parameters[self._support_factor]
        )

    def _solved(self, forces: np.ndarray) -> np.ndarray:
        """Return the solution of K x = forces (n,) of the free unknowns, zero for the others, of all unknowns."""
        here, model = self._here, self._model
        here.gradient()  # sets the branches of angles, from which K is assembled
        try:
            found = model.expand(self._solve(forces))
        except ValueError as error:
            raise NoGradient(f"no derivative of this response: {error}") from error
        left = np.abs(model.reduce(here.product(found)) - forces).max(initial=0.0)
        if not left <= _LEFT * np.abs(forces).max(initial=0.0):  # NaN too
            raise NoGradient(
                "no derivative of this response: the supports leave a motion without stiffness, which a change of the "
                "inputs may set off. Add supports"
            )
        return found

    def _gradient(self, weights: np.ndarray) -> tuple[Gradient, Gradient]:
        """Return the gradients of y . u by the inputs of K, and by those of the response."""
        here, after = self._here, self._after.load_parameters
        fixed = self._at_rest and not here.with_rest
        multiplier = self._solved(self._model.reduce(weights))
        total, by_after = (
            here.hessian_derivatives(multiplier, self._response).times(-1.0),
            np.zeros_like(after),
        )
        for load in self._loads:
            there = here.at(here.state, load.load_parameters(here.load_parameters, after))
            derivatives = (
                there.derivatives_at_fixed_state(multiplier) if fixed else there.derivatives(multiplier)
            )
            by_after = by_after + load.weight * load.after * derivatives.by_load_parameters
            total = total.plus(
                load.weight,
                derivatives._replace(by_load_parameters=load.before * derivatives.by_load_parameters),
            )
        by_values, before, further = self._by_motion(weights - here.product(multiplier))
        total = total._replace(
            by_values=total.by_values + by_values, by_load_parameters=total.by_load_parameters + before
        )
        if self._at_rest:
            total = total.with_state_at_rest()
        else:
            total = total.plus(1.0, here.derivatives(self._solved(-self._model.reduce(total.by_state))))
        of_after = total.at_fixed_state()._replace(by_load_parameters=by_after + further)
        return here.by_inputs(total), here.by_inputs(of_after)

    def _by_motion(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the derivatives of forces . m by all values, by c and by c1."""
        here, entry, further = self._here, self._support_factor, self._further
        power = float(forces @ self._rate)
        at_once = np.zeros_like(here.load_parameters)
        at_once[entry] = power
        if further == 0.0:
            return np.zeros_like(here.inputs.values.numbers), -at_once, at_once

        def at(step: float) -> np.ndarray:
            load_parameters = here.load_parameters.copy()
            load_parameters[entry] += step
            return rows_of([*here.at(here.state, load_parameters).prescribed(forces)[:2]])

        found = directional_derivative(at, list(_STEPS))
        if found is None:
            raise NoGradient("no derivative of this response: supports do not move smoothly")
        by_values, by_load_parameters = found
        values, load_parameters = here.inputs.values.numbers.size, here.load_parameters.size
        return further * by_values[:values], further * by_load_parameters[:load_parameters] - at_once, at_once

    def _tangent(self, changes: list[tuple[Leaf, int, np.ndarray]]) -> np.ndarray:
        """Return du along changes of leaves."""
        here, after, reduce = self._here, self._after.load_parameters, self._model.reduce
        forces, motion, gradient, increment = np.sum([self._rates(*each) for each in changes], axis=0)
        if np.any(gradient) or np.any(increment):
            moved = increment - self._solved(reduce(gradient + here.product(increment)))
            forces = forces - here.hessian_derivatives(self._response, moved).by_state
            for load in self._loads:
                there = here.at(here.state, load.load_parameters(here.load_parameters, after))
                forces = forces + load.weight * there.product(moved)
        return motion + self._solved(reduce(forces - here.product(motion)))

    def _rates(self, leaf: Leaf, part: int, change: np.ndarray) -> np.ndarray:
        """Return the rates of f - K u, m, g(q, c) and what supports prescribe, at the fixed q and u, (4, n).

        The last two are zero at rest, where q stays.
        """
        here, model = self._here, self._model
        if leaf.name == REST and leaf.owner is not None:
            at, steps = self._rows_by_rest(leaf, change), steps_by_rest(leaf, change)
        else:
            inputs = self._inputs_of(part)
            at, steps = self._rows_by_value(inputs, leaf, part, change), steps_along(inputs, leaf, change)
        here.gradient()  # sets the branches of angles
        try:
            rates = directional_derivative(at, steps)
        finally:
            model.set_values(here.inputs.values.numbers)
        if rates is None:
            raise NoGradient(
                f"no tangent by {leaf.name}: the forces are not smooth in it, or it is at the end of its range; take "
                "gradients with backward(), torch.func.vjp or jacrev"
            )
        return rates

    def _rows_by_value(
        self, inputs: Inputs, leaf: Leaf, part: int, change: np.ndarray
    ) -> Callable[[float], np.ndarray]:
        here, model = self._here, self._model

        def at(step: float) -> np.ndarray:
            numbers, load_parameters = changed(inputs, leaf, step * change)
            model.set_values(numbers)
            before, after = (
                (load_parameters, self._after.load_parameters)
                if part == BEFORE
                else (here.load_parameters, load_parameters)
            )
            return self._rows(model, here.state, before, after)

        return at

    def _rows_by_rest(self, leaf: Leaf, change: np.ndarray) -> Callable[[float], np.ndarray]:
        here, after = self._here, self._after.load_parameters

        def at(step: float) -> np.ndarray:
            values = values_in_neighbour(here.inputs, leaf, step * change)
            with values.in_core():
                model = values.scene._model
                state = model.rest_state() if self._at_rest else here.state
                model.term_energies(state, here.angle_branches, here.load_parameters)
                return self._rows(model, state, here.load_parameters, after)

        return at

    def _rows(
        self, model: _core.Model, state: np.ndarray, before: np.ndarray, after: np.ndarray
    ) -> np.ndarray:
        """Return f - K u, m, g(q, c) and what supports prescribe in a model, (4, n)."""
        forces = -model.hessian_product(state, before, self._response)
        for load in self._loads:
            forces += load.weight * model.gradient(state, load.load_parameters(before, after))
        further = after[self._support_factor] - before[self._support_factor]
        found = [forces, further * model.prescribed_rate(before)]
        if self._at_rest:
            return np.stack([*found, *map(np.zeros_like, found)])
        return np.stack([*found, model.gradient(state, before), model.driven_increment(state, before)])

    def _inputs_of(self, part: int) -> Inputs:
        return self._after if part == AFTER else self._here.inputs
