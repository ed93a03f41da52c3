"""The state of a motion as tensors, so that gradients of one motion pass into the motion before it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached, require_torch
from ..._runtime.frozen import immutable
from .trajectory import MotionState, Trajectory

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs


@immutable
@dataclass(frozen=True)
class DifferentiableState:
    """The last state of a motion as tensors of float64, from which ms.simulate(start=...) goes on with gradients.

    positions: (n_v, 3) m; velocities: (n_v, 3) m/s; edge_rotations: (n_e,) rad.

    The next motion has the same bits as one from `Trajectory.end` where that has no accelerations or strain rates, as
    with ImplicitEuler(); by other integrators it begins with accelerations that are computed again.
    """

    positions: Any = field(repr=False)
    velocities: Any = field(repr=False)
    edge_rotations: Any = field(repr=False)
    _numbers: MotionState = field(repr=False)

    @classmethod
    def of(cls, motion: Trajectory, index: int, requires_grad: bool = False) -> DifferentiableState:
        """Return the first or last recorded state of a motion, in its graph if it has one.

        index: 0 or -1. requires_grad: make new tensors instead that gradients are computed for. Raises ValueError for
        scenes with rigid parts and for Maxwell branches, whose states hold more than these tensors.
        """
        torch = require_torch("a DifferentiableState")
        scene, end = motion.scene, motion.end
        if scene.rigid_parts:
            raise ValueError(
                "the scene has rigid parts, whose state has no gradient: a differentiable state needs a scene without them"
            )
        if np.size(end.maxwell_strains):
            raise ValueError(
                "the motion has a Maxwell branch, whose strains have no gradient as a start: leave maxwell_modulus out"
            )
        rows = [each[index] for each in (motion.positions, motion.velocities, motion.edge_rotations)]
        if index == -1:
            state = MotionState(
                end.time,
                end.state,
                end.velocity,
                end.angle_branches,
                clock=end.clock,
                fine_faces=end.fine_faces,
            )
        else:
            model, (x, v, rotations) = scene._model, map(detached, rows)
            state = MotionState(
                float(motion.times[0]),
                model.state(x, rotations),
                model.full_vector(v),
                fine_faces=end.fine_faces,
            )
        tensors = [torch.as_tensor(np.array(each) if isinstance(each, np.ndarray) else each) for each in rows]
        tensors = [each.to(torch.float64) for each in tensors]
        if requires_grad:
            tensors = [each.detach().clone().requires_grad_(True) for each in tensors]
        return cls(*tensors, state)

    @property
    def time(self) -> float:
        """The time since the start of the motion, s."""
        return self._numbers.time

    def detach(self) -> DifferentiableState:
        """Return the state without its graph: gradients end here."""
        return replace(
            self,
            positions=self.positions.detach(),
            velocities=self.velocities.detach(),
            edge_rotations=self.edge_rotations.detach(),
        )

    def _taken_by(self, inputs: Inputs) -> MotionState:
        """Return the state as numbers; its tensors join the leaves of a solve."""
        for name in ("positions", "velocities", "edge_rotations"):
            inputs.take(name, getattr(self, name))
        return self._numbers
