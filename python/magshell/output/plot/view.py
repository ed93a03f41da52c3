"""From where a picture is seen. The projection is parallel: lengths can be measured in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.frozen import immutable
from ..results.state import State

NAMED = {
    "top": (90.0, -90.0),
    "front": (0.0, -90.0),
    "side": (0.0, 0.0),
}  # x to the right, to the right, to the eye
NAMES = ", ".join(map(repr, NAMED))


@immutable
@dataclass(frozen=True)
class View:
    """From where a picture is seen, and how much it shows: `view` of ms.plot, ms.animate and ms.write_page.

    elevation, azimuth: degrees, of the eye above the xy-plane and from x towards y, as in matplotlib. z points up. A pair of
    them is short for a View. frame: m, (2, 3), two opposite corners of a box that the window holds, and no more, so that
    several pictures have one window, or show a part; by default all bodies.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> end = ms.View(30, -60, frame=[(0.08, 0, 0), (0.1, 0.02, 0.01)])
    >>> ms.plot(mesh, view=end, width=800, style=ms.Style(backend="matplotlib"))
    Picture(800 x 803 pixels, painted by matplotlib)
    """

    elevation: float
    azimuth: float
    frame: Any = None

    def __post_init__(self) -> None:
        for name in ("elevation", "azimuth"):
            object.__setattr__(self, name, float(quantity(name, "degrees", getattr(self, name), ())))
        if self.frame is None:
            return
        frame = quantity("frame", "m", self.frame, (2, 3))
        object.__setattr__(self, "frame", tuple(map(tuple, frame.tolist())))
        if not np.ptp(self.project(self.corners)[:, :2], axis=0).max() > 0.0:
            raise ValueError("frame [m] must be two opposite corners of a box, got one place twice")

    @property
    def corners(self) -> np.ndarray | None:
        """(8, 3) m, of the frame, or None."""
        if self.frame is None:
            return None
        return np.stack(np.meshgrid(*np.transpose(self.frame), indexing="ij"), axis=-1).reshape(-1, 3)

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


def view_of(states: list[State], view: View | Sequence[float] | str | None) -> View:
    """The view asked for, a View, (elevation, azimuth) or a word, or one that suits the sheets."""
    if isinstance(view, str):
        if view not in NAMED:
            raise ValueError(
                f"view must be (elevation, azimuth) in degrees, an ms.View, {NAMES}, got {view!r:.60}"
            )
        return View(*NAMED[view])
    if isinstance(view, View):
        return view
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
