"""The obstacles around sheets as solids that one sees through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..states.state import State
from . import colors
from .solids import Solid, sheet

OPACITY = 0.35
REACH = 1.6  # the side of the square that stands for a plane, in sizes of the drawing


def obstacle_solids(states: list[State], size: float) -> list[Solid]:
    """Those of states that lie over each other: one at rest once, a moving one where it is in each state.

    size: of the drawing, m.
    """
    shown = {}
    for state in states:
        time = state.time or 0.0
        for obstacle in state.obstacles:
            key = (id(obstacle), None if obstacle.motion is None else time)
            if key not in shown:
                middle = state.positions.mean(axis=0)
                vertices, faces = obstacle.surface(time, extent=REACH * size, around=middle)
                surface = sheet(vertices, faces, colors.rgb(colors.OBSTACLE))
                shown[key] = replace(surface, opacity=OPACITY)
    return list(shown.values())


def reach(states: list[State], size: float) -> list[np.ndarray]:
    """Points (n, 3) m of all the obstacles in the states, for the window."""
    return [solid.positions for solid in obstacle_solids(states, size)]
