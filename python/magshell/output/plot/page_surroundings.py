"""The surroundings of bodies on a page: each surface is stored once, with its motion or its positions in each state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ..results.state import State
from .solids import Solid
from .surroundings import box_of, inner_solids, obstacle_solids
from .view import View

_RIGID = 1e-6  # [-] largest error of a rigid motion between two surfaces, relative to their extent


@dataclass(frozen=True)
class Pose:
    """A surface in one state: where it was when it was stored, or moved, or with other positions.

    surface: its number. motion: (4, 3), the rows of a rotation matrix, then the displacement, or None. positions: (n, 3) m,
    or None.
    """

    surface: int
    motion: np.ndarray | None = None
    positions: np.ndarray | None = None


class PageSurroundings:
    """The surroundings of bodies in the states of one page: obstacles, magnets, rigid bodies, links, tendons and springs.

    surfaces: those that differ by more than their positions. poses: the surfaces that each state shows.
    """

    def __init__(self, states: list[State], size: float):
        self.surfaces: list[Solid] = []
        self.poses: list[list[Pose]] = []
        self._known: dict[bytes, int] = {}
        middle = np.concatenate([state.positions for state in states]).mean(axis=0)
        before: list[int] = []
        for state in states:
            solids = [*obstacle_solids([state], size, middle), *(solid for _, solid in inner_solids(state))]
            likely = before if len(before) == len(solids) else [None] * len(solids)
            self.poses.append([self._pose(*pair) for pair in zip(solids, likely, strict=True)])
            before = [pose.surface for pose in self.poses[-1]]

    def _pose(self, solid: Solid, likely: int | None) -> Pose:
        """Return where a surface is; a new surface is stored. likely: the number of the surface that it was in the last
        state, or None.
        """
        # A surface of the surroundings has one colour.
        key = solid.positions.tobytes() + solid.faces.tobytes() + solid.colors[0].tobytes()
        if key in self._known:
            return Pose(self._known[key])
        if likely is not None and _same_but_moved(self.surfaces[likely], solid):
            motion = _motion(self.surfaces[likely], solid)
            return Pose(likely, motion, solid.positions if motion is None else None)
        self.surfaces.append(solid)
        self._known[key] = len(self.surfaces) - 1
        return Pose(self._known[key])

    @property
    def numbers_per_state(self) -> int:
        """The largest number of numbers that a state has for its poses."""
        return max(
            sum(20 if pose.positions is None else 8 + pose.positions.size for pose in poses)
            for poses in self.poses
        )

    def points(self, state: int) -> list[np.ndarray]:
        """Return the positions (n, 3) m of each surface in a state."""
        return [self._points(pose) for pose in self.poses[state]]

    def _points(self, pose: Pose) -> np.ndarray:
        if pose.positions is not None:
            return pose.positions
        stored = self.surfaces[pose.surface].positions
        return stored if pose.motion is None else stored @ pose.motion[:3].T + pose.motion[3]

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


def _same_but_moved(one: Solid, other: Solid) -> bool:
    """Return whether two surfaces differ in their positions at most."""
    same = np.array_equal(one.faces, other.faces) and np.array_equal(one.colors, other.colors)
    return same and one.positions.shape == other.positions.shape


def _motion(one: Solid, other: Solid) -> np.ndarray | None:
    """Find the rigid motion (4, 3), as in Pose, from one surface to another; None if there is none."""
    ends = [each.positions.mean(axis=0) for each in (one, other)]
    arms = [each.positions - end for each, end in zip((one, other), ends, strict=True)]
    extent = float(np.abs(arms[0]).max())
    rotation = scipy.spatial.transform.Rotation.align_vectors(*arms[::-1])[0].as_matrix()
    if not np.abs(arms[0] @ rotation.T - arms[1]).max() <= _RIGID * extent:
        return None
    return np.vstack([rotation, ends[1] - rotation @ ends[0]])
