"""The function ms.plot, which draws a picture of bodies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.arrays import index_array
from ..._runtime.mixins import register_method
from ..._runtime.solver_entry_point import grouped
from ...mesh.triangles.self_intersections import AFFORDABLE_FACES
from ..results.state import State, states_of
from ..results.units import length_unit
from . import backend as backends
from .cuts import checked_cut, section
from .limits import check_columns, checked_width
from .panels import Options, draw, size_of
from .picture import Picture, paint
from .playback import evenly_spaced
from .style import Color, Style, colored, style_of
from .surfaces import on_surfaces, scalar_on_surfaces
from .ticks import check_ticks
from .view import View, view_of

if TYPE_CHECKING:
    from ..._input.kinds import Cutting, Fielded, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

MOST_STATES = 9  # states of a path or motion that are drawn by default


@register_method
@grouped(color=Color, view=View, style=Style)
def plot(
    what: Shown,
    *,
    positions: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    states: int | Sequence[int] | None = None,
    color: Any = "auto",
    titles: str | Sequence[str] | None = None,
    overlay: bool = False,
    fade: bool = False,
    columns: int | None = None,
    view: View | Sequence[float] | str | None = None,
    cut: Cutting | None = None,
    width: int = 1600,
    style: Style | None = None,
) -> Picture:
    """Draw a picture of bodies with their magnetization and the field; several states side by side or over each other.

    what: a mesh, a Shell, a Solid, a Scene, a result, or a list of those. Of solids, the surface is drawn.
    positions, remanent_magnetization, applied_flux_density: (n_v, 3) m, (n_f, 3) A/m and (3,) T, for a mesh, which has none
        of them, or instead of those of a result.
    field: fields that vary in space, in the same way.
    obstacles: obstacles around the bodies, drawn transparent; by default those of a scene's contacts.
    states: numbers of the states to draw, of a path or a motion, negative ones from the end; by default all, or nine evenly
        spaced ones if there are more.
    color: the quantity that colours the bodies.
        "magnetization": the component of M_r along its axis if all of it is parallel, else its angle or magnitude.
        "displacement".
        "magnetic_energy": per reference volume.
        "contact_pressure": of a result, the sum over all contacts, on both sides of a shell.
        "von_mises_stress": of a result, the mean of the tetrahedron behind a face, or the larger one of a shell's surfaces.
        "volume_ratio": of the solids of a result, J.
        "membrane_force", "bending_moment": of the shells of a result, the principal value of larger magnitude.
        "activation", "fibre_stretch", "fibre_tension": of solids with muscles.
        An array with a number per face or vertex, or a list of such arrays, one per state. None for uniform colours.
        "auto": magnetization if it varies, else displacement.
        An ms.Color adds a text for the colour bar, its limits and its scale.
    titles: one per state. A note is added where a shell passes through itself, if the states together have at most 20,000
        faces.
    overlay: draw all states in one panel, each with its title next to it. A title that finds no room is left out.
    fade: as `overlay`, with earlier states paler.
    columns: the number of columns of panels, by default the one that fits best.
    view: the direction from which the picture is seen: (elevation, azimuth) in degrees, as in matplotlib, "top", "front"
        (both with x to the right) or "side"; by default one that suits the shape. An ms.View also sets the window.
    cut: a plane that opens solids and cuts shells: "x", "y" or "z" through the middle of the reference shape, ("x", 0.05)
        at that coordinate [m], or a point [m] and a normal, (3,) each. The part on the eye's side of the plane is removed in
        every state. The section is coloured by quantities of tetrahedra, or at vertices by interpolation, and is grey for
        quantities on faces. With mesh lines, it shows the edges of tetrahedra.
    width: pixels, 400 to 8000; a picture has at most 16 million pixels.
    style: an ms.Style: arrows of magnetization, field and contacts, the reference shape, mesh lines, the backend.

    Magnets and wires of fields, magpylib's as well, are drawn at their positions in each state.

    Raises ValueError on bad input, ImportError without matplotlib.

    >>> import magshell as ms
    >>> ms.plot(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), width=800, style=ms.Style(backend="matplotlib"))
    Picture(800 x 343 pixels, painted by matplotlib)
    """
    width = checked_width(width)
    check_columns(columns, width)
    style = style_of(style)
    painter = backends.choose(style.backend)
    drawn = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
    )
    drawn = _chosen(drawn, states)
    titles = noted_crossings(checked_titles(titles, drawn), drawn)
    unit = length_unit(size_of(drawn))
    scalar = scalar_on_surfaces(colored(drawn, color, unit, cut is not None), drawn)
    volumes, drawn = drawn, on_surfaces(drawn)
    seen = view_of(drawn, view)
    plane = checked_cut(cut, volumes, seen)
    if style.ticks:
        check_ticks(seen)
    sections = () if plane is None else tuple(section(state, plane) for state in volumes)
    groups = [drawn] if overlay or fade else [[state] for state in drawn]
    check_contacts(style, drawn)
    options = replace(Options.of(style), fade=fade, cut=plane, sections=sections)
    drawing = draw(groups, titles, scalar, seen, unit, options)
    return paint(drawing, width, columns, painter)


def check_contacts(style: Style, states: list[State]) -> None:
    """Raise ValueError if the style shows contact forces or the thickness, and no state has them."""
    if style.thickness and not any(s.thickness is not None and s.thickness().any() for s in states):
        raise ValueError("thickness is drawn of shells: give a Shell, or a Scene or a result with one")
    if style.contacts and not any(state.loads for state in states):
        raise ValueError("contacts are drawn of a result of a scene with contacts: there is none")


def checked_titles(titles: str | Sequence[str] | None, states: list[State]) -> list[str]:
    """Return one title per state, by default that of its result. Raises ValueError for another number of titles."""
    if titles is None:
        return [state.title for state in states]
    listed = [titles] if isinstance(titles, str) else list(titles)
    if len(listed) != len(states) or not all(isinstance(title, str) for title in listed):
        raise ValueError(f"titles must be {len(states)} strings, one a state, got {titles!r}")
    return listed


def noted_crossings(titles: list[str], states: list[State]) -> list[str]:
    """Return the titles, with a note for states in which a shell passes through itself.

    States with more than AFFORDABLE_FACES faces together are not checked, because this would take long.
    """
    if sum(state.mesh.n_faces for state in states) > AFFORDABLE_FACES:
        return titles
    crosses = [len(state.mesh.self_intersections(state.positions)) > 0 for state in states]
    word = "passes through itself"
    return [
        (f"{title}, {word}" if title else word) if crossing else title
        for title, crossing in zip(titles, crosses, strict=True)
    ]


def _chosen(states: list[State], chosen) -> list[State]:
    """Return the states with the given numbers; by default all, or some evenly spaced ones if there are many."""
    if chosen is None:
        return evenly_spaced(states, MOST_STATES)
    numbers = np.atleast_1d(index_array("states", chosen))
    if not numbers.size or numbers.min() < -len(states) or numbers.max() >= len(states):
        raise ValueError(f"states must be numbers of the {len(states)} states, got {numbers.tolist()}")
    return [states[k] for k in numbers]
