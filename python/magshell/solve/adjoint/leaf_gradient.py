"""The gradient by one input tensor, from the gradients of the core."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...errors import NoGradient
from ...model.scene.reshaped import REST
from ...model.scene.rest_gradient import by_rest_positions
from ...model.scene.values import Gradient

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs, Leaf


def by_leaf(inputs: Inputs, leaf: Leaf, gradient: Gradient) -> np.ndarray:
    """Return the gradient by one leaf, in its shape, from the core's gradients. Raises NoGradient where it has none."""
    if leaf.refusal:
        raise NoGradient(f"no gradient by {leaf.name}: {leaf.refusal}")
    if leaf.owner is None:
        by_rows = np.asarray(gradient.own(leaf.name))
    elif leaf.name == REST:
        if gradient.rest is None:
            raise NoGradient(
                f"no gradient by {REST} of this result: positions of ms.equilibrium and ms.simulate have one"
            )
        by_rows = by_rest_positions(inputs, leaf.owner, gradient)
    elif hasattr(leaf.owner, "by_time_points"):
        by_rows = np.asarray(leaf.owner.by_time_points(gradient))
    else:
        by_rows = np.asarray(inputs.values.gradients(leaf.owner, gradient)[leaf.name])
    if by_rows.size == np.prod(leaf.shape, dtype=int):
        return by_rows.reshape(leaf.shape)
    return by_rows.sum(axis=0).reshape(leaf.shape)  # one value stands for all rows
