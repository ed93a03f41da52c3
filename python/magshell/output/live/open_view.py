"""The function ms.show, which opens a live view in a browser."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.scalars import flag
from ..._input.tensors import detached
from ..._runtime.solver_entry_point import grouped
from ...model.scene.scene import Scene
from ..plot.colors import Scalar
from ..plot.panels import size_of
from ..plot.playback import same_faces, speed_of
from ..plot.style import Color, Style, colored, style_of
from ..plot.surfaces import on_surfaces, scalar_on_surfaces
from ..plot.view import View, view_of
from ..results.state import State, states_of, with_times
from ..results.units import length_unit
from .follower import Follower
from .guard import Guard, guarded
from .library import quiet, require_viser
from .live_view import LiveView
from .movable import movables_of
from .stage import Stage

if TYPE_CHECKING:
    from ..._input.kinds import Numbers, Shown, Starting

_PORTS = (1, 65535)


@grouped(color=Color, view=View, style=Style)
def show(
    what: Shown,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    values: dict[Any, dict[str, Any]] | None = None,
    start: Starting | None = None,
    color: Any = "auto",
    speed: float | None = None,
    title: str = "magshell",
    view: View | Sequence[float] | str | None = None,
    style: Style | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    browser: bool = True,
) -> LiveView:
    """Open a live view in a browser or a notebook: of a result to look around and to play, of a scene to drag its magnets.

    A scene with a field is solved, as by ms.equilibrium, and its bodies follow while magnets, placed fields or dipoles are
    dragged and turned, or a uniform field is changed (see ms.LiveView). Anything else that ms.plot draws is shown as it is;
    states of a path or a motion have a slider and can be played. It needs the package viser (the extra `live`).

    what: as in `plot`; all states must have the same mesh.
    remanent_magnetization, applied_flux_density, values, start: those of ms.equilibrium for a scene with a field; the first
        two also for a mesh, (n_f, 3) A/m and (3,) T. A uniform field begins at 0 T by default.
    positions, times: (n, n_v, 3) m and s, the states of a mesh, as in `animate`.
    speed: seconds of the motion per second of playing, by default as in `animate`.
    color, view, style: as in `plot`. The limits of colours of a scene grow with what is found. It shows no contacts.
    title: that of the panel.
    host, port: the address that the view is served at. The default host serves this machine only. A port that is in
        use is replaced by the next free one. Only who knows the whole address, which contains a random token, can
        open the view, and no page of another site can.
    browser: open the view in a browser, where there is a display. In a notebook it is shown below the cell instead.

    At the end of a script, `.wait()` keeps the view open. Raises ValueError on bad input, ImportError without viser, and
    for a scene the errors of ms.equilibrium.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(8, 2))
    >>> sheet = ms.Shell(mesh, thickness=0.5e-3, young_modulus=1e6)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    >>> view = ms.show(scene, remanent_magnetization=(5e4, 0, 0), browser=False)
    >>> bent = view.set_flux_density((0, 0, 2e-3))
    >>> view.close()
    >>> bool(bent.displacements[:, 2].max() > 1e-4)
    True
    """
    style, live = _checked(style, view, title, host, port, browser), _is_live(what, positions)
    if not live and (values is not None or start is not None):
        raise ValueError("values and start are for a scene with a field, which is solved: there is none")
    viser = require_viser()
    design: dict[str, Any] = {}
    if live:
        design = _design(what, remanent_magnetization, applied_flux_density, values)
        states = states_of(what)
    else:
        states = states_of(
            what,
            positions=positions,
            remanent_magnetization=remanent_magnetization,
            applied_flux_density=applied_flux_density,
        )
    movables = movables_of(what, values) if live else []
    same_faces(states, "a live view")
    states = with_times(states, times)
    speed = speed_of(states, speed)
    seen, size = view_of(states, view), size_of(states)
    coloring = _Coloring(color, size)
    drawn, scalar = coloring(states) if not live else (on_surfaces(states), None)
    guard, server = Guard(host), None
    try:
        with quiet(), guarded(guard):
            server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
    except BaseException:
        if server is not None:
            with quiet():
                server.stop()
        raise
    try:
        sources = np.array([each.center for each in movables]).reshape(-1, 3)
        stage = Stage(server, drawn, size, style, seen, sources)
        shown = LiveView(server, guard.token, drawn, scalar, stage, None if states[0].time is None else speed)
        if live:
            follower = Follower(what, start, shown._found, shown._failed)
            shown._follow(follower, design, movables, coloring)
    except BaseException:
        with quiet():
            server.stop()
        raise
    if browser and "ipykernel" not in sys.modules and _has_display():
        import webbrowser  # for a display alone

        webbrowser.open(shown.url)
    return shown


class _Coloring:
    """Colours states on surfaces. The limits of a scale contain all values so far, so that colours can be compared."""

    def __init__(self, color: Any, size: float):
        self._color, self._unit = color, length_unit(size)
        self._limits: dict[str, tuple[float, float]] = {}

    def __call__(self, states: list[State]) -> tuple[list[State], Scalar | None]:
        scalar = scalar_on_surfaces(colored(states, self._color, self._unit), states)
        if scalar is not None:
            low, high = self._limits.get(scalar.label, scalar.limits)  # another label may have another unit
            limits = min(low, scalar.limits[0]), max(high, scalar.limits[1])
            self._limits[scalar.label] = limits
            scalar = replace(scalar, limits=limits)
        return on_surfaces(states), scalar


def _checked(style: Style | None, view: Any, title: str, host: str, port: int, browser: bool) -> Style:
    style = style_of(style)
    flag("browser", browser)
    if style.contacts or style.ticks or style.thickness:
        raise ValueError(
            "a live view does not show contacts, ticks and thickness: leave them out of its style; ms.plot does"
        )
    if isinstance(view, View) and view.frame is not None:
        raise ValueError("a live view shows all of it, and its reader zooms: leave the frame out of its view")
    for name, text in (("title", title), ("host", host)):
        if not isinstance(text, str) or not text:
            raise ValueError(f"{name} must be a text, got {text!r:.60}")
    if isinstance(port, bool) or not isinstance(port, int) or not _PORTS[0] <= port <= _PORTS[1]:
        raise ValueError(f"port must be a whole number from {_PORTS[0]} to {_PORTS[1]}, got {port!r:.60}")
    return style


def _is_live(what: Any, positions: Any) -> bool:
    """Return whether something can be moved and followed."""
    return isinstance(what, Scene) and bool(what.fields) and positions is None


def _design(scene: Scene, magnetization: Any, flux_density: Any, values: Any) -> dict[str, Any]:
    """Return the arguments of the first equilibrium."""
    design: dict[str, Any] = {"values": values}
    if magnetization is not None:
        design["remanent_magnetization"] = magnetization
    if scene.has_uniform_field:
        given = (0.0, 0.0, 0.0) if flux_density is None else detached(flux_density)
        design["applied_flux_density"] = np.array(quantity("applied_flux_density", "T", given, (3,)))
    elif flux_density is not None:
        design["applied_flux_density"] = flux_density  # an error that the solve explains
    return design


def _has_display() -> bool:
    """Return whether a browser with windows can be opened: elsewhere one that draws text might take the terminal."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
