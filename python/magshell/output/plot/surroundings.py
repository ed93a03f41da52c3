"""What is around sheets: obstacles as solids that one sees through, and magnets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..results.state import State
from . import colors
from .solids import Solid, sheet

OPACITY = 0.35
REACH = 1.6  # the side of the square that stands for a plane, in sizes of the drawing
LARGE = 2.0  # extents of the bodies, beyond which an obstacle is not shown whole
ROOM = 0.15  # extents of the bodies: how far around them it is shown then


def obstacle_solids(states: list[State], size: float, middle: np.ndarray | None = None) -> list[Solid]:
    """Obstacles and magnets of states that lie over each other: one at rest once, a moving one where it is in each state.

    size: of the drawing, m. middle: (3,) m, the place that a plane's square is nearest to; by default that of each state.
    """
    shown = {}
    for state in states:
        time = state.time or 0.0
        for obstacle in state.obstacles:
            key = (id(obstacle), None if obstacle.motion is None else time)
            if key not in shown:
                near = state.positions.mean(axis=0) if middle is None else middle
                vertices, faces = obstacle.surface(time, extent=REACH * size, around=near)
                surface = sheet(vertices, faces, colors.rgb(colors.OBSTACLE))
                shown[key] = replace(surface, opacity=OPACITY, around=True)
    for state in states:
        for points, faces in state.magnets:
            key = (points.tobytes(), None)
            surface = sheet(points, faces, colors.rgb(colors.MAGNET))
            shown.setdefault(key, replace(surface, around=True, smooth=False))  # blocks have sharp edges
    return list(shown.values())


def box_of(bodies: list[np.ndarray], around: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Two corners of the box, on the screen, around points (n, 2 or 3) of bodies, and of each of what is around them: all of
    it where it is not much larger than they are, else no more than is close to them."""
    low, high = (end([end(each, axis=0) for each in bodies], axis=0) for end in (np.min, np.max))
    extent = float((high - low)[:2].max())
    ends = [low, high]
    for points in around:
        if np.ptp(points[:, :2], axis=0).max() > LARGE * extent:
            points = np.clip(points, low - ROOM * extent, high + ROOM * extent)
        ends += [points.min(axis=0), points.max(axis=0)]
    return np.min(ends, axis=0), np.max(ends, axis=0)
