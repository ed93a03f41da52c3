"""The way back from a motion to its inputs: arrays only, autograd.py has the tensors."""

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
    """Gradients of one motion. Keeps what the memory budget allowed to keep of it."""

    def __init__(self, asked: MotionInputs, found: _core.MotionResult):
        self._asked, self._found = asked, found

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """By each wanted leaf of the inputs, shaped like it. Raises NoGradient where there is none."""
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
