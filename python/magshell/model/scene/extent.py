"""Measures how large the bodies of a scene are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .scene import Scene


def extent_of(scene: Scene) -> float:
    """Return the width of the widest shell or solid at rest [m], which rotations keep.

    Without shells and solids it is twice the largest distance of a point of the rigid bodies from the mean of all.
    """
    if scene._bodies.meshes:
        return scene._bodies.extent
    points = scene._model.points(scene._model.rest_state())
    return 2.0 * float(np.linalg.norm(points - points.mean(axis=0), axis=1).max(initial=0.0))
