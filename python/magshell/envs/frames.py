"""Frames of an episode: one view and one window, whatever moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..output.plot import backend as backends
from ..output.plot.frames import Reel, Scenery
from ..output.plot.limits import checked_width
from ..output.plot.panels import Options, size_of
from ..output.plot.style import Style
from ..output.plot.surfaces import on_surfaces
from ..output.plot.view import view_of
from ..output.results.state import State, states_of
from ..output.results.units import length_unit
from .snapshot import Snapshot

if TYPE_CHECKING:
    from ..output.plot.view import View

_AROUND = 0.5  # of the rest shape's size: how much room is around it in the window


class Camera:
    """Paints snapshots. Made with the first; a context of the plotting library is open until `close`."""

    def __init__(
        self,
        first: Snapshot,
        width: int,
        view: View | Sequence[float] | str | None,
        style: Style,
        strongest: np.ndarray | None = None,
    ):
        """strongest: (3,) T, the uniform field that its arrow is scaled by."""
        state = _state(first)
        size = size_of([state])
        room = [
            replace(
                state,
                positions=state.positions + sign * _AROUND * size * axis,
                flux_density=strongest,
                bones=(),
            )
            for axis in np.eye(3)
            for sign in (-1, 1)
        ]
        options = Options.of(style)
        self._scenery = Scenery([state, *room], None, view_of([state], view), length_unit(size), options)
        drawing = self._scenery.drawing(state, None, state.title)
        self._reel = Reel(drawing, checked_width(width), backends.choose(style.backend))
        self._reel.__enter__()

    def frame(self, snapshot: Snapshot) -> np.ndarray:
        """(height, width, 3) uint8."""
        state = _state(snapshot)
        return self._reel.image(self._scenery.drawing(state, None, state.title))

    def close(self) -> None:
        self._reel.__exit__(None, None, None)


def _state(snapshot: Snapshot) -> State:
    [state] = states_of(snapshot)
    [surface] = on_surfaces([replace(state, time=snapshot.time, title=f"{snapshot.time:.3f} s")])
    return surface
