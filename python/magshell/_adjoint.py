"""The way back from an equilibrium to what it was asked for with: arrays only, autograd.py has the tensors."""

from __future__ import annotations

import numpy as np

from . import _core
from ._inputs import Inputs
from .errors import NoGradient


class Adjoint:
    """Gradients of one equilibrium. Keeps its factorization, so that each costs one back-substitution."""

    def __init__(self, inputs: Inputs, found):
        self._inputs, self._found = inputs, found

    def gradients(self, by_positions: np.ndarray, by_edge_rotations: np.ndarray, wanted) -> list[np.ndarray | None]:
        """By each of the inputs' leaves that is wanted, shaped like it. Raises NoGradient where there is none."""
        self._refuse()
        inputs, model = self._inputs, self._inputs.scene._model
        with inputs.in_core():
            gradient = _core.pull_back(model, self._found, by_positions, by_edge_rotations)
        leaves = zip(inputs.leaves, wanted, strict=True)
        return [self._by_leaf(leaf, gradient) if asked else None for leaf, asked in leaves]

    def _by_leaf(self, leaf, gradient: dict) -> np.ndarray:
        values = gradient if leaf.owner is None else self._inputs.values.gradients(leaf.owner, gradient)
        by_rows = np.asarray(values[leaf.name])
        if by_rows.size == np.prod(leaf.shape, dtype=int):
            return by_rows.reshape(leaf.shape)
        return by_rows.sum(axis=0).reshape(leaf.shape)  # one value for every row

    def _refuse(self) -> None:
        found = self._found
        if found.progress < 1.0 or found.outcome != _core.Outcome.converged:
            raise NoGradient(
                f"no gradient here: the solve did not converge, it got {found.progress:.3g} of the way ({found.reason})"
            )
        if not found.stable:
            raise NoGradient(
                f"no gradient here: the equilibrium is not stable ({found.unstable_directions} directions lower its "
                "energy, or its Hessian is singular), and a sheet would not stay in it. Solve with require_stable=True."
            )
