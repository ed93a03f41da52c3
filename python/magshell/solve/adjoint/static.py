"""The adjoint of an equilibrium: gradients by its inputs. Works on arrays; autograd.py has the tensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ... import _core
from ...errors import NoGradient
from ...model.scene.reshaped import REST
from ...model.scene.solve_inputs import Inputs
from ...model.scene.values import Gradient
from .curvature import curvature
from .leaf_gradient import by_leaf
from .tangent import motor_tangent, state_tangent


class Adjoint:
    """The gradients of one equilibrium. Its factorization is stored, so that each costs one back-substitution."""

    def __init__(self, inputs: Inputs, found: _core.StaticsResult):
        self._inputs, self._found = inputs, found

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves of the inputs, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        self._refuse()
        inputs, model = self._inputs, self._inputs.scene._model
        refused = any(leaf.refusal for leaf in inputs.leaves)
        if not (refused or any(np.any(each) for each in by_outputs)):  # those of another load case, say
            return [
                np.zeros(leaf.shape) if asked else None
                for leaf, asked in zip(inputs.leaves, wanted, strict=True)
            ]
        with inputs.in_core():
            by_values, by_load_parameters, *rest = _core.pull_back(
                model, self._found, *by_outputs, requires_rest(inputs, wanted)
            )
        gradient = Gradient(inputs.scene, by_values, by_load_parameters, rest=rest[0] if rest else None)
        leaves = zip(inputs.leaves, wanted, strict=True)
        return [by_leaf(inputs, leaf, gradient) if asked else None for leaf, asked in leaves]

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of positions, edge rotations and forces of motors along changes of all leaves.

        Raises NoGradient where there are none.
        """
        self._refuse()
        inputs, found, model = self._inputs, self._found, self._inputs.scene._model
        n_driven = len(model.driving(found.state, found.load_parameters, found.angle_branches))
        if not any(np.any(each) for each in along):
            change = np.zeros(model.size)
        else:
            change = state_tangent(inputs, found, along)
        driving = motor_tangent(inputs, found, along, change) if n_driven else np.zeros(0)
        return [np.ascontiguousarray(model.points(change)), model.edge_rotations(change), driving]

    def curvature(self, by_outputs: list[np.ndarray], along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the change of the gradients by all leaves along changes of these, at fixed derivatives by the results.

        Raises NoGradient where there is none.
        """
        self._refuse()
        if np.any(by_outputs[2]):
            raise NoGradient("no second derivatives of the forces of motors")
        return curvature(self._inputs, self._found, by_outputs, along)

    def _refuse(self) -> None:
        found = self._found
        if found.load_fraction < 1.0 or found.outcome != _core.Outcome.converged:
            raise NoGradient(
                "no gradient here: the solve did not converge, "
                f"it got {found.load_fraction:.3g} of the way ({found.reason})"
            )
        if not found.stable:
            raise NoGradient(
                "no gradient here: the equilibrium is not stable "
                f"({found.n_negative_eigenvalues} directions lower its energy, or its Hessian is singular), "
                "and no body would stay in it. Solve with require_stable=True."
            )


def requires_rest(inputs: Inputs, wanted: Sequence[bool]) -> bool:
    """Return whether one of the wanted leaves holds rest positions."""
    leaves = zip(inputs.leaves, wanted, strict=True)
    return any(asked and leaf.owner is not None and leaf.name == REST for leaf, asked in leaves)
