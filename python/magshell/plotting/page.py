"""ms.write_page: a sheet that turns in a browser, in one file that asks the network for nothing."""

from __future__ import annotations

import base64
import html
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from . import colors, glyphs
from .colors import Scalar, scalar_of
from .panels import outline, size_of
from .plot import checked_titles
from .states import State, states_of
from .units import LengthUnit, length_unit, with_unit
from .view import view_of


def write_page(
    what,
    path,
    *,
    positions=None,
    remanent_magnetization=None,
    applied_flux_density=None,
    field=None,
    color=None,
    color_label: str | None = None,
    color_range=None,
    arrows: bool | int = True,
    titles=None,
    view=None,
    title: str = "magshell",
) -> Path:
    """Writes a page that shows a sheet from every side, with its magnetization and the field, offline.

    Drag to turn, scroll or pinch to zoom, shift-drag to move; several states, as of a path, get a slider. The
    reader chooses the colours: magnetization, displacement, and what `color` (a name or arrays, as in `plot`)
    adds. In float32 the file holds about 100 bytes a vertex, and 22 more for each state.

    what: as in `plot`, but all states on one mesh. titles: one a state. title: of the page.

    Raises ValueError on bad input, FileNotFoundError without the folder.
    """
    path = Path(path)
    if path.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"a page is saved as .html, got {path.name!r}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path.name!r}: there is no folder {str(path.parent)!r}")
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
    )
    mesh = states[0].mesh
    if any(not np.array_equal(state.mesh.faces, mesh.faces) for state in states):
        raise ValueError("a page shows the states of one mesh, but these have different faces")
    size = size_of(states)
    unit = length_unit(size)
    data = {
        "view": [view_of(states, view).elevation, view_of(states, view).azimuth],
        "size": size,
        "unit": unit._asdict(),
        "palette": {"sheet": colors.SHEET, "field": colors.FIELD},
        "faces": _packed(mesh.faces, "<u4"),
        "outline": _packed(outline(mesh), "<u4"),
        "edges": _packed(mesh.edges, "<u4"),
        "rest": _packed(mesh.rest_positions, "<f4"),
        "scalars": [_scalar(s) for s in _scalars(states, color, color_label, color_range, unit)],
        "states": _states(
            states, checked_titles(titles, states), int(arrows) if arrows is not True else glyphs.ARROWS
        ),
    }
    template = files(__package__).joinpath("page.html").read_text(encoding="utf-8")
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    page = template.replace("{{title}}", html.escape(title)).replace("{{data}}", text)
    path.write_text(page, encoding="utf-8")
    return path


def _scalars(states: list[State], color, label, limits, unit: LengthUnit) -> list[Scalar]:
    """What the reader can choose from; the first is shown first."""
    chosen = [] if color is None else [scalar_of(states, color, label, limits, unit)]
    if any(state.is_magnetized for state in states):
        chosen.append(scalar_of(states, "magnetization", None, None, unit))
    if any(state.displacements.any() for state in states):
        chosen.append(scalar_of(states, "displacement", None, None, unit))
    return list({scalar.label: scalar for scalar in chosen if scalar is not None}.values())


def _scalar(scalar: Scalar) -> dict:
    """One array if it is the same in all states, else one a state."""
    values = scalar.values
    if all(np.array_equal(value, values[0], equal_nan=True) for value in values):
        values = values[:1]
    return {
        "label": _plain(scalar.label),
        "limits": list(scalar.limits),
        "anchors": list(colors.SCALES[scalar.scale]),
        "values": [_packed(value, "<f4") for value in values],
    }


def _states(states: list[State], titles: list[str], count: int) -> list[dict]:
    size, strongest = size_of(states), glyphs.largest(states)
    around, full_length = glyphs.sources_glyphs([[state] for state in states], size)
    packed = []
    for state, title, field in zip(states, titles, around, strict=True):
        one: dict[str, Any] = {"title": title, "positions": _packed(state.positions, "<f4")}
        if count and state.is_magnetized:
            one["magnetization"] = _arrows(glyphs.magnetization_glyphs(state, count, strongest))
            one["magnetizationLabel"] = f"magnetization, up to {with_unit(strongest, 'A/m')}"
        if state.flux_density is not None:
            one["fluxDensity"] = state.flux_density.tolist()
            one["fluxDensityLabel"] = f"B = {with_unit(float(np.linalg.norm(state.flux_density)), 'T')}"
        if field is not None:
            one["field"] = _arrows(field)
            one["fieldLabel"] = f"field, full length at {with_unit(full_length, 'T')}"
        packed.append(one)
    return packed


def _arrows(chosen: glyphs.Glyphs) -> dict:
    """Six numbers an arrow: start, vector."""
    return {"radius": chosen.radius, "arrows": _packed(np.hstack([chosen.starts, chosen.vectors]), "<f4")}


def _packed(array: np.ndarray, dtype: str) -> str:
    return base64.b64encode(np.ascontiguousarray(array, dtype=dtype).tobytes()).decode("ascii")


def _plain(label: str) -> str:
    """Without matplotlib's mathematics."""
    return label.replace("$", "").replace("^3", "³").replace("M_r", "Mᵣ")
