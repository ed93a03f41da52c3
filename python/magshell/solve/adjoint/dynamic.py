"""The adjoint of a motion: gradients by its inputs. Works on arrays; autograd.py has the tensors."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ..._runtime.frozen import remember
from ..._runtime.warning_stacklevel import callers_level
from ...errors import NoGradient, StepErrorWarning
from ...model.scene.values import Gradient
from ..options import ProjectiveDynamics
from .leaf_gradient import by_leaf
from .motion_tangent import motion_tangents
from .static import requires_rest

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from ..dynamics.motion_inputs import MotionInputs


class MotionAdjoint:
    """The gradients of one motion, from as much of it as the memory budget allowed to store.

    known: changes of all leaves, and the tangents along them that were computed with the motion, or why there are none.
    """

    def __init__(
        self,
        asked: MotionInputs,
        found: _core.MotionResult,
        known: tuple[Sequence[np.ndarray], list[np.ndarray] | NoGradient] | None = None,
    ):
        self._asked, self._found, self._known = asked, found, known

    def gradients(self, by_outputs: list[np.ndarray], wanted: Sequence[bool]) -> list[np.ndarray | None]:
        """Compute the gradients by the wanted leaves of the inputs, each in the shape of its leaf.

        Raises NoGradient where there is none.
        """
        self._refuse()
        asked, found, inputs = self._asked, self._found, self._asked.inputs
        with inputs.in_core():
            found_by = _core.pull_back_motion(
                inputs.scene._model, asked.core, found, *by_outputs, requires_rest(inputs, wanted)
            )
        rest = found_by.pop("rest", None)
        if rest is not None and asked.starts_at_rest:
            by_vertices, by_directions = rest
            rest = by_vertices + found_by["positions"], by_directions
        gradient = Gradient(
            inputs.scene, found_by.pop("values"), found_by.pop("load_parameters"), found_by, rest=rest
        )
        leaves = zip(inputs.leaves, wanted, strict=True)
        return [by_leaf(inputs, leaf, gradient) if is_wanted else None for leaf, is_wanted in leaves]

    def tangents(self, along: list[np.ndarray]) -> list[np.ndarray]:
        """Compute the derivatives of positions, edge rotations, velocities and forces of motors along changes of all leaves.

        Raises NoGradient where there are none.
        """
        self._refuse()
        if self._known is not None and all(map(np.array_equal, self._known[0], along)):
            if isinstance(self._known[1], NoGradient):
                raise self._known[1]
            return self._known[1]
        return motion_tangents(self._asked, self._found, along)

    def _refuse(self) -> None:
        asked, found, inputs = self._asked, self._found, self._asked.inputs
        if found.outcome != _core.Outcome.converged:
            raise NoGradient(
                f"no gradient here: the motion stopped after {100 * found.fraction_done:.3g} % of its {asked.steps} steps "
                f"({found.reason})"
            )
        if isinstance(asked.integrator, ProjectiveDynamics):
            why = asked.integrator.without_gradient(inputs.scene)
            if why:
                raise NoGradient(f"no gradient here: {why}")
        _warn_of_jumps(inputs.scene, found.divided)


def _warn_of_jumps(scene: Scene, divided: Sequence[int]) -> None:
    """Warn once per scene that an objective of a motion may jump, because steps that failed were taken in parts."""
    if not len(divided) or scene._warned_of_jumps:
        return
    named = ", ".join(map(str, divided[:5])) + (", ..." if len(divided) > 5 else "")
    warning = StepErrorWarning(
        f"the motion took {len(divided)} steps in parts, or by implicit Euler instead of its integrator (step {named}): the "
        "objective may jump here, because a small change may divide them in another way. Take shorter steps, or "
        "time_step=ms.Adaptive(interval, tolerance) and its time_steps for a line search."
    )
    warnings.warn(warning, stacklevel=callers_level())
    remember(scene, _warned_of_jumps=True)
