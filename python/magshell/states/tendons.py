"""Tendons as surfaces: thin rods from point to point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._checks.tensors import detached
from ..obstacles import Capsule
from ..surroundings.tendon import Tendon
from .bones import joined

if TYPE_CHECKING:
    from .._checks.kinds import SolveResult
    from ..scene.scene import Scene

_THICK = 0.012  # the radius, in the length of a tendon at rest, and at most so much of its shortest segment
_MOST = 0.2


def tendons_of(result: SolveResult) -> list[list[tuple[np.ndarray, np.ndarray]]]:
    """Of every state of a result (one, or k of them), the surfaces of its tendons; none without any."""
    found: list[list[tuple[np.ndarray, np.ndarray]]] = []
    for tendon in _tendons(result.scene):
        points = np.asarray(detached(result[tendon].positions))
        frames = points.reshape(-1, *points.shape[-2:])
        found = found or [[] for _ in frames]
        for state, frame in zip(found, frames, strict=True):
            state.append(_rods(tendon, frame))
    return found


def tendons_at_rest(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of a scene."""
    return [_rods(tendon, tendon.points) for tendon in _tendons(scene)]


def _tendons(scene) -> list[Tendon]:
    return [each for each in scene.actuators if isinstance(each, Tendon)]


def _rods(tendon: Tendon, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    lengths = np.linalg.norm(np.diff(tendon.points, axis=0), axis=1)
    radius = min(_THICK * float(lengths.sum()), _MOST * float(lengths.min()))
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-6 * radius
    rods = [Capsule(np.stack(points[k : k + 2]), radius=radius).surface() for k in np.flatnonzero(apart)]
    return joined(rods) if rods else (np.zeros((0, 3)), np.zeros((0, 3), dtype=int))
