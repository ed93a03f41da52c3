"""What a result says of one rigid part of its scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._machine.frozen import Frozen
from .rigid import Rigid

if TYPE_CHECKING:
    from .._checks.kinds import Computed, SolveResult


class RigidResult(Frozen):
    """A rigid part of a result. Of tensors in their graph, tensors.

    rotation: (..., 3, 3), from how it was turned at rest. center: (..., 3) m, of its own mass as the scene has it: a point
        that stays the same one where a solve has another center.
    """

    body: Rigid

    def __init__(self, result: SolveResult, part: Rigid):
        scene = result.scene
        k = scene._bodies.rigid_number(part)
        self._result, self.body = result, part
        self._place, self._rows = scene._rigid[k], slice(10 * k, 10 * k + 4)
        self._offsets = self._place.rest[:4] - self._place.center

    @property
    def positions(self) -> Computed:
        """(..., k, 3) m, of its vertices, in their order. Raises ValueError for a free body, which has none."""
        if not len(self._place.vertices):
            raise ValueError("a free Rigid has no vertices: ask for its center and rotation")
        return self._result.positions[..., self._place.vertices, :]

    @property
    def rotation(self) -> Computed:
        """Rotation vector, rad: (3,), or (n, 3) of a motion."""
        return self._turned(self._result._own_points[..., self._rows, :])

    @property
    def center(self) -> Computed:
        """m: (3,), or (n, 3) of a motion."""
        return self._result._own_points[..., self._rows, :].mean(-2)

    @property
    def velocity(self) -> Computed:
        """(n, 3) m/s, of the center, of a motion."""
        return self._result._own_velocities[..., self._rows, :].mean(-2)

    @property
    def angular_velocity(self) -> Computed:
        """(n, 3) rad/s, in the world's axes, of a motion."""
        velocities = self._result._own_velocities[..., self._rows, :]
        corners = self._result._own_points[..., self._rows, :]
        around = corners - corners.mean(-2)[..., None, :]
        moments = _cross(around, velocities).sum(-2)
        return moments / (8.0 * self._place.length**2)

    def _turned(self, corners):
        """Of corners c + R rho, sum of (x - c) rho^T over 4 length^2."""
        around = corners - corners.mean(-2)[..., None, :]
        offsets = _like(self._offsets / (4.0 * self._place.length**2), corners)
        return (around[..., :, :, None] * offsets[:, None, :]).sum(-3)

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self.body!r}"


def _like(array: np.ndarray, other):
    return array if isinstance(other, np.ndarray) else other.new_tensor(array)


def _cross(a, b):
    return np.cross(a, b) if isinstance(a, np.ndarray) else a.cross(b, dim=-1)
