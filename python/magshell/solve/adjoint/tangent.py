"""The tangent of an equilibrium: the derivative of its results along a direction of its inputs. Works on arrays.

    H dq_f = -(dg + H_fh dq_h)

dg is the change of the gradient of the energy at the fixed state, and dq_h that of what supports and motors prescribe. Both
are differences along the direction, so that the cost does not grow with the number of inputs: at most eight evaluations of
the gradient, four where it is linear, and one back-substitution with the stored factorization. Where joints move, rigid
bodies stay on them, and the forces of the gradient on the free unknowns change with these.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from ... import _core
from ...errors import NoGradient
from ...model.rigid.joints import Joint
from ...model.scene.reshaped import REST, neighbour
from ...model.scene.values import Values
from .differences import directional_derivative

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs, Leaf

# The first step as a fraction (1) of the largest entry of a value, and the step of a value that is zero (SI unit of the
# value); and the fractions (1) of these that are tried until both orders agree. Tested by
# test_tangents_agree_with_gradients_in_every_kind.
_STEP, _SHORTER = 1 / 64, (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
_STEP_AT_ZERO, _FROM_ZERO = 1e-2, (1.0, 1e2, 1e4, 1e6, 1e-2, 1e-4, 1e-6)


def state_tangent(inputs: Inputs, found: _core.StaticsResult, along: list[np.ndarray]) -> np.ndarray:
    """Return the derivative of all dofs of an equilibrium along changes of all leaves of its inputs.

    Raises NoGradient where there is none.
    """
    model = inputs.scene._model
    total = np.zeros((4, model.size))  # of the gradient, of what is prescribed, and of what joints carry
    with inputs.in_core():
        try:
            model.term_energies(
                found.state, found.angle_branches, inputs.load_parameters
            )  # sets the branches of angles
            for leaf, change in zip(inputs.leaves, along, strict=True):
                if np.any(change):
                    model.set_values(inputs.values.numbers)  # after the differences by another leaf
                    rates = _rates(inputs, found, leaf, change)
                    total[: len(rates)] += rates
        finally:
            model.set_values(inputs.values.numbers)
        gradient, prescribed, moved, free = total
        if not (np.any(moved) or np.any(free)):
            return _core.push_forward(model, found, gradient, prescribed)
        return _core.push_forward(model, found, gradient, prescribed, moved, free[: model.free_size])


def motor_tangent(
    inputs: Inputs, found: _core.StaticsResult, along: list[np.ndarray], change: np.ndarray
) -> np.ndarray:
    """Return the derivative of the forces of motors along changes of all leaves, with which all dofs change so."""
    model, state, angle_branches = inputs.scene._model, found.state, found.angle_branches
    total = np.zeros(len(model.driving(state, found.load_parameters, angle_branches)))
    size = float(np.abs(change).max(initial=0.0))
    with inputs.in_core():
        try:
            if size > 0.0:
                steps = [_STEP * inputs.scene._bodies.extent * factor / size for factor in _SHORTER]
                total += _required(
                    directional_derivative(
                        lambda t: model.driving(state + t * change, inputs.load_parameters, angle_branches)[
                            None
                        ],
                        steps,
                    )
                )[0]
            for leaf, each in zip(inputs.leaves, along, strict=True):
                if not np.any(each):
                    continue

                def at(step: float, leaf=leaf, each=each) -> np.ndarray:
                    with _changed_model(inputs, leaf, step * each) as (there, load_parameters):
                        return there.driving(state, load_parameters, angle_branches)[None]

                total += _required(directional_derivative(at, _steps(inputs, leaf, each)))[0]
        finally:
            model.set_values(inputs.values.numbers)
    return total


def _required(derivative: np.ndarray | None) -> np.ndarray:
    if derivative is None:
        raise NoGradient("no tangent of the forces of motors: they are not smooth in the inputs")
    return derivative


def _reshapes(leaf: Leaf) -> bool:
    return leaf.name == REST and leaf.owner is not None


def _steps(inputs: Inputs, leaf: Leaf, change: np.ndarray) -> list[float]:
    return steps_by_rest(leaf, change) if _reshapes(leaf) else steps_along(inputs, leaf, change)


@contextmanager
def _changed_model(
    inputs: Inputs, leaf: Leaf, change: np.ndarray
) -> Iterator[tuple[_core.Model, np.ndarray]]:
    """Yield the model with a changed leaf set, and its load parameters. By rest positions it is that of another scene."""
    if _reshapes(leaf):
        values = values_in_neighbour(inputs, leaf, change)
        with values.in_core():
            yield values.scene._model, inputs.load_parameters
    else:
        model = inputs.scene._model
        numbers, load_parameters = changed(inputs, leaf, change)
        model.set_values(numbers)
        yield model, load_parameters


def changed(inputs: Inputs, leaf: Leaf, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of all values and the load parameters after the change of a leaf. Raises ValueError beyond its
    range."""
    if leaf.owner is None and leaf.name != "remanent_magnetization":
        layout, key = inputs.scene._load_parameter_layout, ("scene", leaf.name)
        now = _added(layout.of(inputs.load_parameters, *key)[0], change)
        return inputs.values.numbers, layout.packed({key: now}, inputs.load_parameters)
    return changed_values(inputs, leaf, change).numbers, inputs.load_parameters


def changed_values(inputs: Inputs, leaf: Leaf, change: np.ndarray) -> Values:
    """Return the values of the scene after the change of a leaf that is one of them. Raises ValueError beyond its range."""
    scene, values = inputs.scene, inputs.values
    replaced, magnetization = values.replaced, inputs.magnetization
    if leaf.owner is None:
        magnetization = _added(magnetization, change)
    else:
        now = _added(values.replaced[leaf.owner][leaf.name], change)
        replaced = {**replaced, leaf.owner: {**replaced[leaf.owner], leaf.name: now}}
    return Values(scene, replaced, magnetization, sampling_of=values)


def _added(value, change: np.ndarray) -> np.ndarray:
    value = np.asarray(value, dtype=np.float64)
    return value + np.broadcast_to(change, value.shape)


def _rates(inputs: Inputs, found: _core.StaticsResult, leaf: Leaf, change: np.ndarray) -> np.ndarray:
    """Return the derivatives of the gradient at the fixed state, and of the increments to what is prescribed, (2, n).

    By a joint, or by the rest positions of vertices of rigid bodies, (4, n): also of the state that stays on joints and
    bodies, and of the gradient on the free unknowns there, zeros after that.
    """
    if leaf.refusal:
        raise NoGradient(f"no tangent by {leaf.name}: {leaf.refusal}")
    model, state, load_parameters = inputs.scene._model, found.state, inputs.load_parameters
    reshapes = _reshapes(leaf)
    if reshapes:
        moves = any(part.vertices is not None for part in inputs.scene.rigid_parts)
    else:
        moves = isinstance(leaf.owner, Joint) and leaf.name in leaf.owner._geometry
    gradient = model.gradient(state, load_parameters) if moves else np.zeros(0)
    # The gradient on the free unknowns and the increments of motors vanish by cancellation: of all forces, and of places.
    forces_and_places = np.abs(gradient).max(initial=0.0), np.abs(state).max(initial=0.0)
    sizes = np.array([1.0 / each if each > 0.0 else 0.0 for each in forces_and_places])[[0, 1, 1, 0]]

    def rows(there: _core.Model, load_parameters: np.ndarray) -> np.ndarray:
        forces = there.gradient(state, load_parameters)
        if not moves:
            return np.stack([forces, there.driven_increment(state, load_parameters)])
        moved, driven, free = _core.state_on_joints(there, state, load_parameters, gradient)
        return np.stack([forces, driven, moved, np.pad(free, (0, len(state) - len(free)))])

    def at(step: float) -> np.ndarray:
        with _changed_model(inputs, leaf, step * change) as (there, load_parameters):
            if reshapes:
                there.term_energies(state, found.angle_branches, load_parameters)
            return rows(there, load_parameters)

    rates = directional_derivative(at, _steps(inputs, leaf, change), sizes=sizes if moves else None)
    return rates if rates is not None else _refuse_kink(leaf)


def _refuse_kink(leaf: Leaf) -> NoReturn:
    raise NoGradient(
        f"no tangent by {leaf.name}: the forces are not smooth in it, or it is at the end of its range; take gradients with "
        "backward(), torch.func.vjp or jacrev"
    )


def values_in_neighbour(inputs: Inputs, leaf: Leaf, change: np.ndarray) -> Values:
    """Return the values in a scene with other rest positions, which has the numbering of the inputs' scene.

    leaf: rest positions of a body. Raises ValueError for some that do not fit.
    """
    body = leaf.owner
    there = neighbour(inputs.scene, {body: body.mesh.rest_positions + change})
    replaced = {there._own(owner): named for owner, named in inputs.values.replaced.items()}
    return Values(there, replaced, inputs.magnetization, sampling_of=inputs.values)


def steps_by_rest(leaf: Leaf, change: np.ndarray) -> list[float]:
    """Return the steps along a change of rest positions that are tried one after another."""
    shortest = float(leaf.owner.mesh.edge_lengths.min())
    return [_STEP * shortest * factor / np.abs(change).max() for factor in _SHORTER]


def steps_along(inputs: Inputs, leaf: Leaf, change: np.ndarray) -> list[float]:
    """Return the steps along a change that are tried one after another."""
    if leaf.owner is not None:
        value = inputs.values.replaced[leaf.owner][leaf.name]
    elif leaf.name == "remanent_magnetization":
        value = inputs.magnetization
    else:
        value = inputs.scene._load_parameter_layout.of(inputs.load_parameters, "scene", leaf.name)
    size, length = np.abs(np.asarray(value)).max(initial=0.0), np.abs(change).max()
    if size == 0.0:
        return [_STEP_AT_ZERO * factor / length for factor in _FROM_ZERO]
    return [_STEP * size * factor / length for factor in _SHORTER]
