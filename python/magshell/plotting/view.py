"""From where a picture is seen. The projection is parallel: lengths can be measured in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._checks.quantity import quantity
from ..states.state import State


@dataclass(frozen=True)
class View:
    """Degrees: elevation above the xy-plane, azimuth of the eye from x towards y. z points up."""

    elevation: float
    azimuth: float

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): rows are the unit vectors to the right, upwards and to the eye."""
        elevation, azimuth = np.radians([self.elevation, self.azimuth])
        eye = np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        return np.stack([right, np.cross(eye, right), eye])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) to (right, up, towards the eye), m."""
        return points @ self.axes.T


def view_of(states: list[State], view) -> View:
    """The view asked for as (elevation, azimuth), or one that suits the sheets."""
    if view is not None:
        return View(*quantity("view", "degrees", view, (2,)).tolist())
    return _default(np.concatenate([s.mesh.rest_positions for s in states]))


def _default(rest: np.ndarray) -> View:
    """A flat sheet is seen obliquely, a strip lies across; anything else is seen from the usual corner."""
    _, extents, axes = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=False)
    long, normal = axes[0], axes[2]
    if extents[2] > 0.2 * extents[1]:
        return View(25.0, -60.0)
    if abs(normal[2]) < 0.7:  # an upright sheet, seen from its front
        elevation, azimuth = 20.0, _nearest(_azimuth(normal), -60.0)
    elif extents[0] < 1.2 * extents[1]:
        elevation, azimuth = 30.0, -85.0
    else:
        elevation, azimuth = 20.0, _nearest(_azimuth(long) + 90.0, -80.0)
    turn = 18.0 if extents[0] > 3.0 * extents[1] else 25.0
    views = [View(elevation, azimuth + angle) for angle in (turn, -turn, 180.0 + turn, 180.0 - turn)]
    seen = [abs(view.axes[2] @ normal) for view in views]
    return next(
        (view for view, share in zip(views, seen, strict=True) if share > 0.3), views[int(np.argmax(seen))]
    )


def _azimuth(vector: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(vector[1], vector[0])))


def _nearest(azimuth: float, wanted: float) -> float:
    """The azimuth or its opposite, whichever is closer to the wanted one, in (-180, 180]."""
    difference = (azimuth - wanted + 90.0) % 180.0 - 90.0
    return wanted + difference
