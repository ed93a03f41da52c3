"""The function ms.animate, which writes a movie of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.mixins import register_method
from ..._runtime.progress import SolveBar
from ..._runtime.solver_entry_point import grouped
from ..results.state import State, states_of, with_times
from ..results.units import length_unit
from . import backend as backends
from . import films
from .colors import Scalar
from .drawing import check_contacts
from .frames import Reel, Scenery
from .limits import checked_width
from .panels import Drawing, Options, size_of
from .playback import (
    Moment,
    between,
    describe_speed,
    evenly_spaced,
    moments,
    same_faces,
    speed_of,
    state_at,
)
from .style import Color, Style, colored, style_of
from .surfaces import on_surfaces, scalar_on_surfaces
from .ticks import check_ticks
from .view import View, view_of

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, FilePath, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

SLOWEST, FASTEST = 0.01, 1000.0  # [1/s] smallest and largest number of frames per second
PALETTE_FRAMES = 12  # frames from which the colours of a GIF are chosen


@register_method
@grouped(color=Color, view=View, style=Style)
def animate(
    what: Shown,
    path: FilePath,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    speed: float | None = None,
    fps: float = 25.0,
    color: Any = "auto",
    title: str | None = None,
    view: View | Sequence[float] | str | None = None,
    width: int = 1000,
    style: Style | None = None,
    progress: bool = True,
) -> Path:
    """Write a movie of a motion as .gif or .mp4; the arrow of a uniform field follows its changes.

    what: a Trajectory, an EquilibriumPath, or anything else that `plot` takes, with at least two states of one mesh.
    times: s, one per state, if positions (n, n_v, 3) of a mesh are given. States without times are shown one per frame;
        between states with times, frames are interpolated linearly.
    speed: seconds of the motion per second of the movie, such as 0.1 for ten times slower. By default 1 for a motion of 3
        to 20 s, and otherwise a round number that makes the movie about 8 s long. The movie shows it.
    obstacles: as in `plot`; obstacles with a motion move.
    fps: frames per second. A .gif stores the time of a frame in hundredths of a second, and at most 50 frames per second. A
        movie has at most 20,000 frames.
    title: the text before the time. progress: show a progress bar once writing has taken two seconds. The other arguments
        are as in `plot`.

    Colours, arrows and the window have one scale for the whole motion. An .mp4 needs ffmpeg (the extra `movie`).
    An existing file is replaced once the new one is complete; after an error or Ctrl-C it stays as it was.

    Raises ValueError on bad input, FileNotFoundError if the folder does not exist, OSError if the file cannot be written,
    ImportError without matplotlib or, for an .mp4, without ffmpeg.

    >>> import magshell as ms, tempfile, numpy as np
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> rising = np.stack([mesh.rest_positions + np.array([0, 0, height]) for height in (0, 0.01)])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.animate(mesh, f"{folder}/rise.gif", positions=rising, width=400, style=ms.Style(backend="matplotlib")).name
    'rise.gif'
    """
    fps = float(quantity("fps", "1/s", fps, ()))
    if not SLOWEST <= fps <= FASTEST:
        raise ValueError(f"fps [1/s] must be positive, from {SLOWEST:g} to {FASTEST:g}, got {fps:g}")
    width = checked_width(width)
    style = style_of(style)
    path = films.checked_path(path, fps)
    if path.suffix.lower() == ".gif":
        fps = 100 / round(100 / fps)  # the format stores hundredths of a second
    painter = backends.choose(style.backend)
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
    )
    if len(states) < 2:
        raise ValueError("a movie needs at least two states, got one; ms.plot makes a picture of it")
    same_faces(states, "a movie")
    states = with_times(states, times)
    speed = speed_of(states, speed)
    unit = length_unit(size_of(states))
    scalar = scalar_on_surfaces(colored(states, color, unit), states)
    states = on_surfaces(states)
    check_contacts(style, states)
    options = Options.of(style)
    seen = view_of(states, view)
    if style.ticks:
        check_ticks(seen)
    scenery = Scenery(states, scalar, seen, unit, options)
    shown = moments(states, fps, speed)

    def drawing(moment: Moment) -> Drawing:
        state = state_at(states, moment)
        return scenery.drawing(state, _values(scalar, moment), _caption(title, state, states[-1], speed))

    with Reel(drawing(shown[-1]), width, painter) as reel, SolveBar("animate", progress) as bar:
        some = evenly_spaced(shown, PALETTE_FRAMES) if path.suffix.lower() == ".gif" else []
        samples = [reel.image(drawing(moment)) for moment in some]
        films.write(path, (reel.image(drawing(moment)) for moment in bar.through(shown)), samples, fps)
    return path


def _values(scalar: Scalar | None, moment: Moment) -> np.ndarray | None:
    if scalar is None:
        return None
    if not moment.fraction:
        return scalar.values[moment.before]
    return between(scalar.values[moment.before], scalar.values[moment.before + 1], moment.fraction)


def _caption(title: str | None, state: State, last: State, speed: float) -> str:
    """Return the text above a frame: the title, the time, and the speed of playback."""
    parts = [title] if title else []
    if state.time is None:
        return "   ".join([*parts, state.title])
    return "   ".join([*parts, state.title.rjust(len(last.title), "\N{FIGURE SPACE}"), describe_speed(speed)])
