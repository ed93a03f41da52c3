"""Second derivatives of functions of an equilibrium, times a direction. Works on arrays; autograd.py has the tensors.

For a function y . q of the state q that is an equilibrium for the inputs k, with fixed weights y, the gradient is
mu . dg/dk with K mu = -y. Along a direction of k, q changes by dq (a tangent), and the gradient by

    mu . d(dg/dk) + dmu . dg/dk,      K dmu = -(dK) mu

where d( ) is the change of both along the direction, with dq. It is a difference of (K mu, mu . dg/dk) at a fixed mu.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ..._input.tensors import detached
from ...errors import NoGradient
from ...model.scene.reshaped import REST
from ...model.scene.values import Gradient, Values
from .differences import ROUNDING, directional_derivative
from .energy import Unknowns
from .leaf_gradient import by_leaf
from .residual import Residual
from .tangent import state_tangent, steps_along

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs

# The first step moves the ends of an edge apart by this fraction (1) of its length at most, and turns it by as much in rad;
# and the fractions (1) of it that are tried. What a bent sheet does is smooth over much longer steps than its edges, and
# round-off of its stiff stretching is large over shorter ones. Tested by
# test_hessians_of_a_fine_sheet_are_not_lost_to_round_off.
_STEP, _SHORTER = 1 / 256, (1.0, 0.25, 0.1, 1e-2, 1e-3)


def curvature(
    inputs: Inputs, found: _core.StaticsResult, by_outputs: list[np.ndarray], along: list[np.ndarray]
) -> list[np.ndarray]:
    """Return the change of the gradient by each leaf along changes of all leaves, at fixed derivatives by the results.

    Raises NoGradient where there is none.
    """
    scene, model = inputs.scene, inputs.scene._model
    if scene.own_field is not None:
        raise NoGradient("no second derivatives with own_field: its stiffness is not a sparse matrix")
    if scene.rigid_parts:
        raise NoGradient("no second derivatives in scenes with rigid bodies or skeletons")
    if any(leaf.name == REST and leaf.owner is not None for leaf in inputs.leaves):
        raise NoGradient(f"no second derivatives with {REST} among the inputs: detach them")
    if not any(np.any(each) for each in along) or not any(np.any(each) for each in by_outputs):
        return [np.zeros(leaf.shape) for leaf in inputs.leaves]
    weights = Unknowns("equilibrium", scene).gathered.T @ np.concatenate(
        [by_outputs[0].ravel(), by_outputs[1]]
    )
    motion = state_tangent(inputs, found, along)
    nothing = np.zeros(model.size)
    with inputs.in_core():
        Residual(
            inputs, found.state, found.angle_branches, inputs.load_parameters
        ).hessian()  # refuses one that is not symmetric
        multiplier = _core.push_forward(model, found, weights, nothing)

    def at(step: float, multiplier: np.ndarray, weights: np.ndarray) -> list[np.ndarray]:
        there = moved_inputs(inputs, [step * each for each in along])
        with there.in_core():
            residual = Residual(
                there, found.state + step * motion, found.angle_branches, there.load_parameters
            )
            derivatives = residual.derivatives(multiplier)
            through = residual.prescribed(derivatives.by_state + weights)
        gradient = Gradient(
            scene, derivatives.by_values + through[0], derivatives.by_load_parameters + through[1]
        )
        return [derivatives.by_state, *(by_leaf(there, leaf, gradient).ravel() for leaf in inputs.leaves)]

    parts = at(0.0, multiplier, weights)
    rates = directional_derivative(
        lambda step: rows_of(at(step, multiplier, weights)),
        _steps(inputs, motion, along),
        ROUNDING,
        _sizes(inputs),
    )
    if rates is None:
        raise NoGradient(
            "no second derivatives here: the forces are not smooth in the inputs, or one is at the end of its range"
        )
    with inputs.in_core():
        change = _core.push_forward(model, found, rates[0][: model.size], nothing)
    others = at(0.0, change, nothing)
    return [
        (rates[k][: parts[k].size] + others[k]).reshape(leaf.shape)
        for k, leaf in enumerate(inputs.leaves, start=1)
    ]


def rows_of(parts: list[np.ndarray]) -> np.ndarray:
    """Return vectors of different lengths as rows of one array, filled up with zeros."""
    rows = np.zeros((len(parts), max(part.size for part in parts)))
    for row, part in zip(rows, parts, strict=True):
        row[: part.size] = part
    return rows


def moved_inputs(inputs: Inputs, changes: list[np.ndarray]) -> Inputs:
    """Return the inputs after changes of all leaves. Raises ValueError beyond the range of a value."""
    scene, replaced = inputs.scene, {owner: dict(named) for owner, named in inputs.values.replaced.items()}
    magnetization, load_parameters = inputs.magnetization, inputs.load_parameters
    for leaf, change in zip(inputs.leaves, changes, strict=True):
        if leaf.owner is not None:
            before = np.asarray(replaced[leaf.owner][leaf.name], dtype=np.float64)
            replaced[leaf.owner][leaf.name] = before + np.broadcast_to(change, before.shape)
        elif leaf.name == "remanent_magnetization":
            magnetization = magnetization + np.broadcast_to(change, magnetization.shape)
        else:
            layout, key = scene._load_parameter_layout, ("scene", leaf.name)
            load_parameters = layout.packed(
                {key: layout.of(load_parameters, *key)[0] + change}, load_parameters
            )
    there = copy.copy(inputs)
    there.values = (
        Values(scene, replaced, magnetization, sampling_of=inputs.values)
        if replaced or magnetization is not None
        else inputs.values
    )
    there.load_parameters = load_parameters
    return there


def _steps(inputs: Inputs, motion: np.ndarray, along: list[np.ndarray]) -> list[float]:
    """Return the steps that are tried one after another."""
    scene, model = inputs.scene, inputs.scene._model
    moved, deformed = model.positions(motion), 0.0
    for span in scene._bodies.spans:
        edges, at = span.mesh.edges, moved[span.vertices]
        apart, length = (
            np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
            for points in (at, span.mesh.rest_positions)
        )
        deformed = max(deformed, float((apart / length).max(initial=0.0)))
    rotated = np.abs(model.edge_rotations(motion)).max(initial=0.0)
    first = [_STEP / size for size in (deformed, rotated) if size > 0.0]
    changed = [(leaf, change) for leaf, change in zip(inputs.leaves, along, strict=True) if np.any(change)]
    # A value that is zero has no size: then the motion says how far to go, if there is one.
    sized = [each for each in changed if np.any(detached(each[0].tensor))] if first else changed
    first += [steps_along(inputs, leaf, change)[0] for leaf, change in sized]
    return [min(first) * shorter for shorter in _SHORTER]


def _sizes(inputs: Inputs) -> np.ndarray:
    """Return the sizes of the rows of derivatives: the shortest edge, and the largest number of each leaf."""
    edge = inputs.scene.mesh.edge_lengths.min(initial=np.inf)
    numbers = (np.asarray(detached(leaf.tensor)) for leaf in inputs.leaves)
    sizes = [edge, *(np.abs(each).max(initial=0.0) for each in numbers)]
    return np.where(np.isfinite(sizes), sizes, 0.0)
