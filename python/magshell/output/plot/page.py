"""The function ms.write_page, which writes an interactive view for browsers to one file that works offline."""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.scalars import positive
from ..._runtime.files import replace_file
from ..._runtime.solver_entry_point import grouped
from ..results.probes import Probe
from ..results.series import probe_columns
from ..results.state import State, states_of, with_times
from ..results.tables import coordinate_of
from ..results.units import LengthUnit, length_unit, prefixed, with_unit
from . import colors, glyphs
from .colors import Scalar, scalar_of
from .drawing import checked_titles
from .limits import arrow_count
from .outlines import outline
from .page_surroundings import PageSurroundings
from .panels import FLESH, size_of
from .playback import SAMPLES, evenly_spaced, same_faces, speed_of
from .solids import Solid
from .style import Color, Style, colored, style_of
from .surfaces import on_surfaces, scalar_on_surfaces
from .view import View, view_of

if TYPE_CHECKING:
    from ..._input.kinds import Fielded, FilePath, Numbers, Shown
    from ...model.contact.obstacles.obstacle import Obstacle


@grouped(color=Color, view=View, style=Style)
def write_page(
    what: Shown,
    path: FilePath,
    *,
    positions: Numbers | None = None,
    times: Numbers | None = None,
    remanent_magnetization: Numbers | None = None,
    applied_flux_density: Numbers | None = None,
    field: Fielded | None = None,
    obstacles: Obstacle | Sequence[Obstacle] | None = None,
    color: Any = None,
    titles: str | Sequence[str] | None = None,
    view: View | Sequence[float] | str | None = None,
    title: str = "magshell",
    speed: float | None = None,
    size_limit: float = 10e6,
    probes: Probe | Sequence[Probe] = (),
    style: Style | None = None,
) -> Path:
    """Write an HTML page that shows bodies from all sides, with their magnetization and the field; it works offline.

    The reader drags to rotate, scrolls or pinches to zoom, and shift-drags to move. The states of a path or a motion can be
    played and chosen by a slider; a motion starts by itself. The reader chooses the colours: magnetization, displacement,
    and the quantity that `color` (a name or arrays, as in `plot`) adds. Obstacles, magnets and wires of fields, magpylib's
    as well, free rigid bodies, links, tendons, springs and creases are shown at their positions in each state; bodies with
    links or tendons inside are transparent.

    what, obstacles: as in `plot`, but all states must have the same mesh. titles: one per state. title: that of the page.
    positions, remanent_magnetization, applied_flux_density, field, view: as in `plot`.
    times: s, one per state, if positions (n, n_v, 3) of a mesh are given.
    speed: seconds of the motion per second of playing, which the reader can change; by default as in `animate`. States
        without times are shown at ten per second.
    size_limit: bytes for the states. They are stored in float32 (16 bytes per vertex for the positions, 6 for a scalar that
        changes) if they fit, else in 16 bits (half the size, accurate to 1/65000 of the shape's size), else as many evenly
        spaced states as fit; the page says how many there were. The mesh takes about 85 bytes per vertex, the viewer 25 kB.
    probes: of a result; the page draws a curve of each ms.Probe over the states, with the number of the state that is shown.
        The reader chooses a column of them, and a state by a click on the curve.
    style: as in `plot`; the reader can show and hide the rest shape and the mesh lines. A page does not show contacts.

    Raises ValueError on bad input, FileNotFoundError if the folder does not exist.

    >>> import magshell as ms, tempfile
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     ms.write_page(mesh, f"{folder}/sheet.html").name
    'sheet.html'
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"a page is saved as .html, got {path.name!r}")
    style = style_of(style)
    count = arrow_count(style.arrows)
    if style.contacts or style.ticks or style.thickness:
        raise ValueError(
            "a page does not show contacts, ticks and thickness: leave them out of its style; ms.plot and ms.animate do"
        )
    if isinstance(view, View) and view.frame is not None:
        raise ValueError("a page shows all of it, and its reader zooms: leave the frame out of its view")
    if not isinstance(title, str):
        raise ValueError(f"title must be a string, got {title!r:.60}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path.name!r}: there is no folder {str(path.parent)!r}")
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
        obstacles=obstacles,
    )
    same_faces(states, "a page")
    size_limit = positive("size_limit", "bytes", size_limit)
    states = with_times(states, times)
    speed = speed_of(states, speed)
    size = size_of(states)
    unit = length_unit(size)
    scalars = [scalar_on_surfaces(scalar, states) for scalar in _scalars(states, color, unit)]
    states = on_surfaces(states)
    mesh = states[0].mesh
    titles = checked_titles(titles, states)
    surroundings = PageSurroundings(states, size)
    if not style.show_field:
        states = [replace(state, flux_density=None, fields=()) for state in states]
    fields = _sources(states, size)
    # How many numbers a state stores: positions, arrows, scalars that change, surroundings, and arrows of the field.
    numbers = 3 * mesh.n_vertices + 6 * count + sum(len(s.values[0]) for s in scalars if not _is_constant(s))
    numbers += surroundings.numbers_per_state
    numbers += max((6 * len(field.starts) for field in fields[0] if field is not None), default=0)
    history = page_history(what, probes, positions)
    if history is not None:  # `along` and each curve: four bytes a number, times 4/3 in base64
        size_limit = max(size_limit - 16 / 3 * len(states) * (1 + len(history[2])), 1.0)
    dtype, chosen = _choose_states(len(states), numbers, size_limit)
    seen = view_of(states, view)
    data = {
        "view": [seen.elevation, seen.azimuth],
        "size": size,
        "unit": unit._asdict(),
        "palette": {"sheet": colors.SHEET, "field": colors.FIELD, "crease": colors.CREASE},
        "faces": _packed(mesh.faces, "<u4"),
        "outline": _packed(outline(mesh), "<u4"),
        "edges": _packed(mesh.edges, "<u4"),
        "creases": _packed(np.asarray(states[0].creases, dtype=np.int64), "<u4"),
        "flesh": FLESH if any(state.links or state.tendons for state in states) else 1.0,
        "rest": _packed(mesh.rest_positions, "<f4"),
        "scalars": [_scalar(s, chosen, dtype) for s in scalars],
        "states": _states(states, chosen, titles, fields, count, dtype, surroundings),
        "around": [_surface(each) for each in surroundings.surfaces],
        "window": _window(surroundings.window(states, seen)),
        "recorded": len(states),
        "history": _history(history, chosen),
        "shown": {"rest": style.rest, "edges": style.mesh_lines},
        "speed": None if states[0].time is None else speed,
    }
    template = files(__package__).joinpath("page.html").read_text(encoding="utf-8")
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    parts = {"title": html.escape(title), "data": text}
    # one pass, so that the inserted texts are not searched
    page = re.sub(r"\{\{(title|data)\}\}", lambda found: parts[found[1]], template)
    replace_file(path, lambda file: file.write(page.encode()))
    return path


def _scalars(states: list[State], color, unit: LengthUnit) -> list[Scalar]:
    """Return the scalars among which the reader can choose; the first one is shown at the start."""
    chosen = [] if color is None else [colored(states, color, unit)]
    if any(state.is_magnetized for state in states):
        chosen.append(scalar_of(states, "magnetization", None, None, unit))
    if any(state.displacements.any() for state in states):
        chosen.append(scalar_of(states, "displacement", None, None, unit))
    return list({scalar.label: scalar for scalar in chosen if scalar is not None}.values())


def _is_constant(scalar: Scalar) -> bool:
    return all(np.array_equal(value, scalar.values[0], equal_nan=True) for value in scalar.values)


def _scalar(scalar: Scalar, chosen: list[int], dtype: str) -> dict[Any, Any]:
    """Encode a scalar, with one array if it is the same in all states, otherwise one per state."""
    values = scalar.values[:1] if _is_constant(scalar) else [scalar.values[k] for k in chosen]
    return {
        "label": _plain(_label(scalar)),
        "limits": list(scalar.limits),
        "anchors": list(colors.SCALES[scalar.scale]),
        "values": [_packed(value, dtype) for value in values],
    }


def _label(scalar: Scalar) -> str:
    """Return the text of a colour bar, with the names of values in brackets."""
    named = ", ".join(f"{value:g}: {text}" for value, text in scalar.names)
    return f"{scalar.label} ({named})".strip() if named else scalar.label


def _choose_states(count: int, numbers: int, size_limit: float) -> tuple[str, list[int]]:
    """Choose the number format and the states to store, so that they take at most `size_limit` bytes.

    numbers: how many a state has.
    """
    for dtype, each in (("<f4", 4), ("<u2", 2)):
        bytes_per_state = each * numbers * 4 / 3 + 300  # base64, and the JSON around it
        if count * bytes_per_state <= size_limit:
            return dtype, list(range(count))
    return "<u2", evenly_spaced(list(range(count)), max(2, int(size_limit / bytes_per_state)))


def _sources(states: list[State], size: float) -> tuple[list[glyphs.Glyphs | None], float]:
    """Return arrows of fields that vary in space around each state, and the flux density [T] of full length.

    In a motion, their positions are the same for all states.
    """
    if not any(state.has_sources for state in states):
        return [None] * len(states), 0.0
    if states[0].time is None:
        points = [glyphs.halo([state], size) for state in states]
    else:
        points = [glyphs.halo(evenly_spaced(states, SAMPLES), size)] * len(states)
    return glyphs.sources_glyphs(states, points, size)


def _states(
    states: list[State],
    chosen: list[int],
    titles: list[str],
    fields,
    count: int,
    dtype: str,
    surroundings: PageSurroundings,
) -> list[dict[Any, Any]]:
    """Encode the chosen states. fields: as `_sources` returns them; count: the number of magnetization arrows."""
    strongest, (around, full_length) = glyphs.largest(states), fields
    magnitude = max(
        (np.linalg.norm(s.flux_density) for s in states if s.flux_density is not None), default=0.0
    )
    factor, unit = prefixed(float(magnitude), "T")
    packed = []
    for k in chosen:
        state, field = states[k], around[k]
        one: dict[str, Any] = {"title": titles[k], "positions": _packed(state.positions, dtype)}
        if state.time is not None:
            one["time"] = state.time
        if count and state.is_magnetized:
            one["magnetization"] = _arrows(glyphs.magnetization_glyphs(state, count, strongest), dtype)
            one["magnetizationLabel"] = f"magnetization, up to {with_unit(strongest, 'A/m')}"
        if state.flux_density is not None:
            one["fluxDensity"] = state.flux_density.tolist()
            one["fluxDensityLabel"] = f"B = {np.linalg.norm(state.flux_density) / factor:.3g} {unit}"
        if field is not None:
            one["field"] = _arrows(field, dtype)
            one["fieldLabel"] = f"field, full length at {with_unit(full_length, 'T')}"
        if surroundings.poses[k]:
            one["around"] = [
                {"surface": pose.surface}
                | ({} if pose.motion is None else {"place": _packed(pose.motion, "<f4")})
                | ({} if pose.positions is None else {"positions": _packed(pose.positions, dtype)})
                for pose in surroundings.poses[k]
            ]
        packed.append(one)
    return packed


def _surface(solid: Solid) -> dict[str, Any]:
    return {
        "positions": _packed(solid.positions, "<f4"),
        "faces": _packed(solid.faces, "<u4"),
        "color": np.asarray(solid.colors[0]).tolist(),
        "opacity": solid.opacity,
        "smooth": solid.smooth,
    }


def _history(
    found: tuple[str, np.ndarray, dict[str, np.ndarray]] | None, chosen: list[int]
) -> dict[str, Any] | None:
    """Encode curves over all recorded states, and the numbers of those that the page shows."""
    if found is None:
        return None
    name, along, columns = found
    curves = [{"name": column, "values": _packed(values, "<f4")} for column, values in columns.items()]
    return {"along": {"name": name, "values": _packed(along, "<f4")}, "columns": curves, "numbers": chosen}


def _window(found: tuple[np.ndarray, np.ndarray, float] | None) -> dict[str, Any] | None:
    if found is None:
        return None
    middle, half, farthest = found
    return {"middle": middle.tolist(), "half": half.tolist(), "farthest": farthest}


def _arrows(chosen: glyphs.Glyphs, dtype: str) -> dict[Any, Any]:
    """Encode arrows with six numbers each: start, vector."""
    return {"radius": chosen.radius, "arrows": _packed(np.hstack([chosen.starts, chosen.vectors]), dtype)}


def _packed(array: np.ndarray, dtype: str) -> str | dict[Any, Any]:
    """Encode an array in base64.

    For "<u2" the values are scaled to 16 bits, and the values of 0 and of a step of 1 are stored with them; arrays with NaN
    are stored as "<f4" instead.
    """
    if dtype != "<u2":
        return base64.b64encode(np.ascontiguousarray(array, dtype=dtype).tobytes()).decode("ascii")
    if not array.size or not np.isfinite(array).all():
        return _packed(array, "<f4")
    low = float(array.min())
    step = float(np.ptp(array)) / 65535 or 1.0
    return {"low": low, "step": step, "u2": _packed(np.round((array - low) / step), "<H")}


def _plain(label: str) -> str:
    """Return a label without matplotlib's mathematical markup."""
    return label.replace("$", "").replace("^3", "³").replace("M_r", "Mᵣ")


def page_history(
    what: Any, probes: Probe | Sequence[Probe], positions: Any
) -> tuple[str, np.ndarray, dict[str, np.ndarray]] | None:
    """Return the name and the values (n,) of what curves are drawn over, and the columns {name: (n,)}; None without probes.

    Raises ValueError as `probe_columns` does.
    """
    columns = probe_columns(what, probes, positions)
    if not columns:
        return None
    name, values = coordinate_of(what)
    along = np.zeros(1) if values is None else np.asarray(values, dtype=np.float64)
    return {"time": "time [s]", None: ""}.get(name, name), along, columns
