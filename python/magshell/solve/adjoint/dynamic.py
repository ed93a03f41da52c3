"""The adjoint of a motion: gradients by its inputs. Works on arrays; autograd.py has the tensors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...errors import NoGradient
from ...model.scene.values import Gradient
from ..options import ProjectiveDynamics
from .static import by_leaf

if TYPE_CHECKING:
    from ..dynamics.motion_inputs import MotionInputs


class MotionAdjoint:
    """The gradients of one motion, from as much of it as the memory budget allowed to store."""

    def __init__(self, asked: MotionInputs, found: _core.MotionResult):
        self._asked, self._found = asked, found

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves of the inputs, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        asked, found, inputs = self._asked, self._found, self._asked.inputs
        if found.outcome != _core.Outcome.converged:
            raise NoGradient(
                f"no gradient here: the motion stopped after {found.steps_done} of {asked.steps} steps ({found.reason})"
            )
        if isinstance(asked.integrator, ProjectiveDynamics):
            why = asked.integrator.without_gradient(inputs.scene)
            if why:
                raise NoGradient(f"no gradient here: {why}")
        with inputs.in_core():
            found_by = _core.pull_back_motion(inputs.scene._model, asked.core, found, *by_outputs)
        gradient = Gradient(inputs.scene, found_by.pop("values"), found_by.pop("controls"), found_by)
        leaves = zip(inputs.leaves, wanted, strict=True)
        return [by_leaf(inputs, leaf, gradient) if is_wanted else None for leaf, is_wanted in leaves]

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Raise NoGradient: motions have no forward mode."""
        raise NoGradient(
            "no tangents of a motion: ms.simulate has gradients in reverse mode only. Use backward(), torch.func.vjp or "
            'jacrev, and GaussNewton(jacobian="backward")'
        )
