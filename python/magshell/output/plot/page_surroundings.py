"""The surroundings of bodies on a page: each surface is stored once, with its rigid motion in each state."""

from __future__ import annotations

import numpy as np
import scipy

from ..results.state import State
from . import colors
from .solids import Solid, sheet
from .surroundings import box_of, obstacle_solids
from .view import View

_RIGID = 1e-6  # [-] largest error of a rigid motion between two surfaces, relative to their extent


class PageSurroundings:
    """Obstacles, magnets and free rigid bodies in the states of one page.

    surfaces: those that differ by more than a rigid motion. poses: a list per state, of (number of the surface, motion) for
    each surface that the state shows. The motion (4, 3) has the rows of a rotation matrix, then the displacement; it is None
    if the surface is where it was when it was stored.
    """

    def __init__(self, states: list[State], size: float):
        self.surfaces: list[Solid] = []
        self.poses: list[list[tuple[int, np.ndarray | None]]] = []
        self._known: dict[bytes, int] = {}
        middle = np.concatenate([state.positions for state in states]).mean(axis=0)
        before: list[int] = []
        for state in states:
            parts = [sheet(*each, colors.rgb(colors.LINK)) for each in state.shapes]
            solids = [*obstacle_solids([state], size, middle), *parts]
            likely = before if len(before) == len(solids) else [None] * len(solids)
            self.poses.append([self._pose(*pair) for pair in zip(solids, likely, strict=True)])
            before = [number for number, _ in self.poses[-1]]

    def _pose(self, solid: Solid, likely: int | None) -> tuple[int, np.ndarray | None]:
        """Return the number of a surface and its motion; a new surface is stored.

        likely: the number of the surface that it was in the last state, or None.
        """
        # A surface of the surroundings has one colour.
        key = solid.positions.tobytes() + solid.faces.tobytes() + solid.colors[0].tobytes()
        if key in self._known:
            return self._known[key], None
        moved = None if likely is None else _motion(self.surfaces[likely], solid)
        if moved is not None:
            return likely, moved
        self.surfaces.append(solid)
        self._known[key] = len(self.surfaces) - 1
        return self._known[key], None

    def points(self, state: int) -> list[np.ndarray]:
        """Return the positions (n, 3) m of each surface in a state."""
        return [
            self.surfaces[k].positions
            if moved is None
            else self.surfaces[k].positions @ moved[:3].T + moved[3]
            for k, moved in self.poses[state]
        ]

    def window(self, states: list[State], view: View) -> tuple[np.ndarray, np.ndarray, float] | None:
        """Return the window that a page shows when it is opened, or None if there are no surroundings.

        The window is its center (3,) m, half its width and height (2,) m, and the largest distance of any point of any state
        from its center, m.
        """
        if not self.surfaces:
            return None
        bodies = [x for state in states for x in (state.positions, state.mesh.rest_positions)]
        around = [points for k in range(len(states)) for points in self.points(k)]
        low, high = box_of(*([view.project(each) for each in some] for some in (bodies, around)))
        middle = 0.5 * (low + high) @ view.axes
        farthest = max(np.linalg.norm(each - middle, axis=1).max() for each in (*bodies, *around))
        return middle, 0.5 * (high - low)[:2], float(farthest)


def _motion(one: Solid, other: Solid) -> np.ndarray | None:
    """Find the rigid motion (4, 3), as in PageSurroundings, from one surface to another; None if there is none."""
    same = np.array_equal(one.faces, other.faces) and np.array_equal(one.colors, other.colors)
    if not same or one.positions.shape != other.positions.shape:
        return None
    ends = [each.positions.mean(axis=0) for each in (one, other)]
    arms = [each.positions - end for each, end in zip((one, other), ends, strict=True)]
    extent = float(np.abs(arms[0]).max())
    rotation = scipy.spatial.transform.Rotation.align_vectors(*arms[::-1])[0].as_matrix()
    if not np.abs(arms[0] @ rotation.T - arms[1]).max() <= _RIGID * extent:
        return None
    return np.vstack([rotation, ends[1] - rotation @ ends[0]])
