"""Handles in the browser by which magnets and dipoles are dragged and turned."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ..plot import colors
from .movable import Movable
from .patches import bytes_of
from .stage import SHOWN_SIZE, Stage

_GIZMO = 0.22  # [-] length of a handle's arrows over the size of the bodies


class Gizmo:
    """The handle of one source: it moves the source's pose and calls `moved`."""

    def __init__(self, server: Any, stage: Stage, movable: Movable, name: str, moved: Callable[[], None]):
        self.movable = movable
        self._stage = stage
        self._first = movable.center.copy(), movable.rotation.copy()
        self.handle: Any = server.scene.add_transform_controls(
            name, scale=_GIZMO * SHOWN_SIZE, depth_test=False, **self._pose()
        )
        for number, (points, faces, color) in enumerate(movable.surfaces(stage.size)):
            shade = bytes_of(colors.rgb(color))
            stage.put_fixed(f"{name}/surface_{number}", points * stage.scale, faces, shade)

        @self.handle.on_update
        async def _(event: Any) -> None:  # in the server's loop, so that poses keep their order
            movable.center = stage.from_view(self.handle.position)
            movable.rotation = scipy.spatial.transform.Rotation.from_quat(
                np.asarray(self.handle.wxyz), scalar_first=True
            ).as_rotvec()
            moved()

    def show(self) -> None:
        """Move the handle to the pose of its source."""
        for name, value in self._pose().items():
            setattr(self.handle, name, value)

    def reset(self) -> None:
        """Put the source and the handle back to where they were at first."""
        self.movable.center, self.movable.rotation = (each.copy() for each in self._first)
        self.show()

    def _pose(self) -> dict[str, tuple[float, ...]]:
        turned = scipy.spatial.transform.Rotation.from_rotvec(np.array(self.movable.rotation)).as_quat(
            scalar_first=True
        )
        return {
            "position": tuple(self._stage.to_view(self.movable.center).tolist()),
            "wxyz": tuple(turned.tolist()),
        }
