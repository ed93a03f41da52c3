"""Draws the frames of an episode, all with one view and in one window."""

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

_AROUND = 0.5  # [-] margin of the window around the rest shape, in units of its size


class Camera:
    """A painter of snapshots, made with the first one; it holds a window of the plotting library until `close`."""

    def __init__(
        self,
        first: Snapshot,
        width: int,
        view: View | Sequence[float] | str | None,
        style: Style,
        strongest: np.ndarray | None = None,
    ):
        """Set up the view and the window. strongest: (3,) T, the uniform field whose arrow has the full length."""
        state = _state(first)
        size = size_of([state])
        room = [
            replace(
                state,
                positions=state.positions + sign * _AROUND * size * axis,
                flux_density=strongest,
                links=(),
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
        """Draw a snapshot: returns (height, width, 3) uint8."""
        state = _state(snapshot)
        return self._reel.image(self._scenery.drawing(state, None, state.title))

    def close(self) -> None:
        """Close the window."""
        self._reel.__exit__(None, None, None)


def _state(snapshot: Snapshot) -> State:
    [state] = states_of(snapshot)
    [surface] = on_surfaces([replace(state, time=snapshot.time, title=f"{snapshot.time:.3f} s")])
    return surface
