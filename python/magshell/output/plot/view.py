"""The direction from which a picture is seen. The projection is parallel, so lengths can be measured in pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.frozen import immutable
from ..results.state import State

# (elevation, azimuth) in degrees; the x axis points to the right, to the right, and towards the eye
NAMED = {"top": (90.0, -90.0), "front": (0.0, -90.0), "side": (0.0, 0.0)}
NAMES = ", ".join(map(repr, NAMED))


@immutable
@dataclass(frozen=True)
class View:
    """The direction from which a picture is seen, and its window: `view` of ms.plot, ms.animate and ms.write_page.

    elevation, azimuth: degrees, the angles of the eye above the xy-plane and from x towards y, as in matplotlib; z points
        up.
    A pair of them is short for a View. frame: m, (2, 3), two opposite corners of a box that fills the window, so that
    several pictures have the same window, or show a part; by default the window contains all bodies.

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
            raise ValueError("frame [m] must be two opposite corners of a box, got the same point twice")

    @property
    def corners(self) -> np.ndarray | None:
        """The corners of the frame, (8, 3) m, or None without a frame."""
        if self.frame is None:
            return None
        return np.stack(np.meshgrid(*np.transpose(self.frame), indexing="ij"), axis=-1).reshape(-1, 3)

    @property
    def axes(self) -> np.ndarray:
        """The unit vectors to the right, upwards and towards the eye, as the rows of a matrix (3, 3)."""
        elevation, azimuth = np.radians([self.elevation, self.azimuth])
        eye = np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        return np.stack([right, np.cross(eye, right), eye])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the coordinates (right, up, towards the eye) of points (..., 3), m."""
        return points @ self.axes.T


def view_of(states: list[State], view: View | Sequence[float] | str | None) -> View:
    """Return the view that a caller gives: a View, (elevation, azimuth), a name, or None for one that suits the bodies."""
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
    """Choose a view: flat shapes are seen obliquely, strips lie horizontally, others are seen from a standard direction."""
    _, extents, axes = np.linalg.svd(rest - rest.mean(axis=0), full_matrices=False)
    long, normal = axes[0], axes[2]
    if extents[2] > 0.2 * extents[1]:
        return View(25.0, -60.0)
    if abs(normal[2]) < 0.7:  # an upright flat shape is seen from its front
        elevation, azimuth = 20.0, _nearest(_azimuth(normal), -60.0)
    elif extents[0] < 1.2 * extents[1]:
        elevation, azimuth = 30.0, -85.0
    else:
        elevation, azimuth = 20.0, _nearest(_azimuth(long) + 90.0, -80.0)
    offset = 18.0 if extents[0] > 3.0 * extents[1] else 25.0
    views = [View(elevation, azimuth + angle) for angle in (offset, -offset, 180.0 + offset, 180.0 - offset)]
    cosines = [abs(view.axes[2] @ normal) for view in views]
    oblique = (view for view, cosine in zip(views, cosines, strict=True) if cosine > 0.3)
    return next(oblique, views[int(np.argmax(cosines))])


def _azimuth(vector: np.ndarray) -> float:
    return float(np.degrees(np.arctan2(vector[1], vector[0])))


def _nearest(azimuth: float, wanted: float) -> float:
    """Return the azimuth or its opposite, in degrees, whichever is closer to the wanted one."""
    difference = (azimuth - wanted + 90.0) % 180.0 - 90.0
    return wanted + difference
