"""Second derivatives of energies that begin with gradients with respect to values. Works on arrays; autograd.py has the
tensors.

For a sum of energies E with weights w, and a direction u of the values k, u . dE/dk has these derivatives, each of them a
rate of change along u:

    by positions: that of the gradient,    by values: that of dE/dk,    by the weights: that of the energies

They are differences of high order along the one direction u.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from .curvature import moved_inputs, rows_of
from .differences import directional_derivative
from .energy import POSITIONAL, EnergyAdjoint
from .tangent import steps_along

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Leaf

# Fractions (1) of the first step that are tried. Tested by test_second_derivatives_by_values_agree_with_differences.
_SHORTER = (1.0, 0.1, 1e-2)
# The error (1) of derivatives with respect to values, over their largest entry: they are differences themselves. Tested
# by the same.
_OF_DIFFERENCES = 1e-11


def is_positional(leaf: Leaf) -> bool:
    """Return whether a leaf holds positions or edge rotations."""
    return leaf.owner is None and leaf.name in POSITIONAL


def rates_along_values(
    adjoint: EnergyAdjoint,
    weights: np.ndarray,
    along: Sequence[np.ndarray | None],
    wanted: Sequence[bool],
) -> tuple[np.ndarray, list[np.ndarray | None]]:
    """Compute the derivatives of u . dE/dk by the weights (n,), and by the wanted leaves.

    along: u, one change for each leaf; None for positions. Raises NoGradient where there are none.
    """
    inputs = adjoint.inputs
    values = [leaf for leaf in inputs.leaves if not is_positional(leaf)]
    changes = [
        np.zeros(leaf.shape) if change is None else change
        for leaf, change in zip(inputs.leaves, along, strict=True)
        if not is_positional(leaf)
    ]
    if not any(np.any(each) for each in changes):
        leaves = zip(inputs.leaves, wanted, strict=True)
        return np.zeros_like(weights), [np.zeros(leaf.shape) if asked else None for leaf, asked in leaves]
    base = copy.copy(inputs)
    base.leaves = values

    def at(step: float) -> list[np.ndarray]:
        there = adjoint.with_inputs(moved_inputs(base, [step * each for each in changes]), inputs.leaves)
        with there.inputs.in_core():
            energies = np.array([*there.by_name().values()])
        found = there.gradients(weights, wanted)
        return [energies, *(each.ravel() for each in found if each is not None)]

    steps = [
        steps_along(inputs, leaf, change)
        for leaf, change in zip(values, changes, strict=True)
        if np.any(change)
    ]
    first = min(each[0] for each in steps)
    parts = at(0.0)
    rates = directional_derivative(
        lambda step: rows_of(at(step)), [first * shorter for shorter in _SHORTER], _OF_DIFFERENCES
    )
    if rates is None:
        raise NoGradient("no second derivatives of energies here: they are not smooth in the values")
    found = iter(row[: part.size] for row, part in zip(rates[1:], parts[1:], strict=True))
    by_leaves = [
        next(found).reshape(leaf.shape) if asked else None
        for leaf, asked in zip(inputs.leaves, wanted, strict=True)
    ]
    return rates[0][: weights.size], by_leaves
