"""ms.plot: a picture of sheets."""

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
from .playback import spread
from .style import Color, Style, colored, style_of
from .surfaces import on_surfaces, scalar_on_surfaces
from .view import View, view_of

if TYPE_CHECKING:
    from ..._input.kinds import Cutting, Fielded, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle

MOST_STATES = 9  # of a path, unless asked for more


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
    """A picture of a sheet, its magnetization and the field; of several, side by side or over each other.

    what: a mesh, a Shell, a Solid, a Scene, a result, or a list of those. Of solids, their surface is drawn.
    positions, remanent_magnetization, applied_flux_density, field: (n_v, 3) m, (n_f, 3) A/m, (3,) T and
        fields that vary in space: for a mesh, which has none, or instead of a result's own.
    obstacles: what is around the sheet, one one sees through; by default what the contacts of a scene are about.
    states: numbers of those to draw, of a path or a motion; by default all, or nine evenly spread ones.
    color: "magnetization" (the component of M_r along the axis that all of it shares, else its angle or
        magnitude), "displacement", "magnetic_energy" (a rest volume), of a result "contact_pressure" (of all contacts, on
        both sides of a sheet) and "von_mises_stress" (the mean of the tetrahedron behind a face; of a sheet the larger of
        both surfaces'), of its solids "volume_ratio" (J), of its sheets "membrane_force" or "bending_moment" (the larger
        principal one),
        with muscles "activation", "fibre_stretch" or "fibre_tension",
        an array with a number a face or a vertex, a list of such arrays, one a state, or None for plain sheets.
        "auto": magnetization if it varies, else displacement.
        An ms.Color has a text for the colour bar, its ends and its scale.
    titles: one a state; that a sheet passes through itself is added, where there are at most 20,000 faces to look at.
    overlay: all states in one panel, each with its title beside it; one that finds no room, as of many states in a small
        picture, is left out. fade: with the earlier ones paler, as a strobe light shows a motion.
    columns: of panels, by default what fits best.
    view: (elevation, azimuth) in degrees of the eye, as in matplotlib, "top", "front" (both with x to the right) or "side";
        by default what suits the sheet. An ms.View says also what the window holds.
    cut: a plane that opens solids (and cuts sheets): "x", "y" or "z" through the middle of the rest shape, ("x", 0.05) at
        that place [m], or a point [m] and a normal, (3,) each. What is on the eye's side of it, in every state as it is,
        is taken away; the section has the colours of the tetrahedra for what they have, of displacements and numbers at
        vertices those between, and is grey where a color is one of faces; with the mesh's lines, the tetrahedra's edges.
    width: pixels, 400 to 8000; a picture has at most 16 million of them.
    style: an ms.Style: arrows of magnetization, field and contacts, the rest shape, the mesh's lines, who paints.

    Magnets and wires of fields, magpylib's too, are drawn where they were in each state.

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
    whole, drawn = drawn, on_surfaces(drawn)
    seen = view_of(drawn, view)
    plane = checked_cut(cut, whole, seen)
    sections = () if plane is None else tuple(section(state, plane) for state in whole)
    groups = [drawn] if overlay or fade else [[state] for state in drawn]
    check_contacts(style, drawn)
    options = replace(Options.of(style), fade=fade, cut=plane, sections=sections)
    drawing = draw(groups, titles, scalar, seen, unit, options)
    return paint(drawing, width, columns, painter)


def check_contacts(style: Style, states: list[State]) -> None:
    """Raises ValueError where contacts are asked for and there are none."""
    if style.contacts and not any(state.loads for state in states):
        raise ValueError("contacts are drawn of a result of a scene with contacts: there is none")


def checked_titles(titles: str | Sequence[str] | None, states: list[State]) -> list[str]:
    """One title a state; by default what its result calls it."""
    if titles is None:
        return [state.title for state in states]
    listed = [titles] if isinstance(titles, str) else list(titles)
    if len(listed) != len(states) or not all(isinstance(title, str) for title in listed):
        raise ValueError(f"titles must be {len(states)} strings, one a state, got {titles!r}")
    return listed


def noted_crossings(titles: list[str], states: list[State]) -> list[str]:
    """The titles, with a word where the sheet passes through itself. As they are where looking costs much."""
    if sum(state.mesh.n_faces for state in states) > AFFORDABLE_FACES:
        return titles
    crosses = [len(state.mesh.self_intersections(state.positions)) > 0 for state in states]
    word = "passes through itself"
    return [
        (f"{title}, {word}" if title else word) if crossing else title
        for title, crossing in zip(titles, crosses, strict=True)
    ]


def _chosen(states: list[State], chosen) -> list[State]:
    """The states of the given numbers; by default all, and of many some evenly spread ones."""
    if chosen is None:
        return spread(states, MOST_STATES)
    numbers = np.atleast_1d(index_array("states", chosen))
    if not numbers.size or numbers.min() < -len(states) or numbers.max() >= len(states):
        raise ValueError(f"states must be numbers of the {len(states)} states, got {numbers.tolist()}")
    return [states[k] for k in numbers]
