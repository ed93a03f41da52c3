"""Options for the look of pictures, movies and pages: Style and Color."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._input.scalars import flag
from ..._runtime.frozen import immutable
from ..results.state import State
from ..results.units import LengthUnit
from .backend import BACKENDS
from .colors import SCALES, Scalar, averaged_at_vertices, scalar_of
from .limits import arrow_count


@immutable
@dataclass(frozen=True)
class Style:
    """The things that are drawn in addition to the bodies, and the backend: `style` of ms.plot, ms.animate, ms.write_page.

    arrows: arrows of the current magnetization: True for about 60 on a body, False for none, or their approximate number.
    show_field: show a uniform field as one arrow next to the bodies, and a field that varies in space as arrows around them.
    rest: show the rest shape as a faint outline. mesh_lines: show the edges of the mesh.
    contacts: show the forces of all contacts, friction included, as arrows at the vertices, in front of everything else.
    ticks: show coordinates along the edges of a picture or movie that is seen along an axis: view="front", "side" or "top".
    thickness: draw shells with their thickness, so that a sheet seen edge-on is not a line.
    backend: "magshell", "matplotlib" or "pyvista"; by default that of the environment variable MAGSHELL_PLOT, else
        "magshell", which paints pixels with a depth buffer, without a graphics driver. "matplotlib" paints polygons, which
        stay vectors in a PDF or SVG but may be sorted wrongly; "pyvista" paints by VTK. A page is painted by the browser
        that shows it.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> bare = ms.Style(arrows=False, mesh_lines=True, backend="matplotlib")
    >>> ms.plot(mesh, remanent_magnetization=(4e4, 0, 0), style=bare, width=800)
    Picture(800 x 343 pixels, painted by matplotlib)
    """

    arrows: bool | int = True
    show_field: bool = True
    rest: bool = False
    mesh_lines: bool = False
    contacts: bool = False
    ticks: bool = False
    thickness: bool = False
    backend: str | None = None

    def __post_init__(self) -> None:
        arrow_count(self.arrows)
        for name in ("show_field", "rest", "mesh_lines", "contacts", "ticks", "thickness"):
            flag(name, getattr(self, name))
        if self.backend is not None and self.backend not in BACKENDS:
            raise ValueError(
                f"backend must be one of {', '.join(map(repr, BACKENDS))}, got {self.backend!r:.60}"
            )


def style_of(style: Style | None) -> Style:
    """Return the style that a caller gives, or the default for None. Raises ValueError if it is not a Style."""
    if style is None:
        return Style()
    if not isinstance(style, Style):
        raise ValueError(f"style must be an ms.Style, got {style!r:.60}")
    return style


@immutable
@dataclass(frozen=True)
class Color:
    """A quantity that colours bodies, with its label, range and scale: `color` of ms.plot, ms.animate and ms.write_page.

    Use it to give several pictures the same colours, or to change the default ones.

    values: as `color` of ms.plot: a name, or numbers on faces or vertices. label: the text at the colour bar, with the unit.
    range: (low, high), in the unit of the values; by default the range of the values. scale: "sequential", "diverging"
    (symmetric about 0 unless `range` is given) or "cyclic"; by default the one that suits the name, "sequential" for
    numbers. names: texts for values, {0: "sheet", 1: "ball"}, which the colour bar shows instead of numbers.
    averaged: numbers on faces are drawn as means at vertices, weighted by the areas of their faces at present (nodal
        averaging), so that stresses vary smoothly. Jumps between materials are smoothed too, and peaks become lower: the
        colour bar shows the range of the means. Bodies are averaged apart. Not for cyclic scales, whose angles have no mean.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> heights = ms.Color(mesh.rest_positions[:, 2], label="height [m]", range=(-0.01, 0.01), scale="diverging")
    >>> ms.plot(mesh, color=heights, width=800, style=ms.Style(backend="matplotlib"))
    Picture(800 x 343 pixels, painted by matplotlib)
    """

    values: Any
    label: str | None = None
    range: Any = None
    scale: str | None = None
    names: Any = None
    averaged: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", _checked_names(self.names))
        flag("averaged", self.averaged)
        if isinstance(self.values, np.ndarray):
            object.__setattr__(self, "values", self.values.copy())
        if not isinstance(self.label, str | None):
            raise ValueError(f"the label of a color must be a string, got {self.label!r:.60}")
        if self.scale is not None and self.scale not in SCALES:
            raise ValueError(
                f"the scale of a color must be {', '.join(SCALES)} or None, got {self.scale!r:.60}"
            )


def _checked_names(names: Any) -> tuple[tuple[float, str], ...]:
    """Return the names of values in the order of the values. Raises ValueError unless it is {number: text}."""
    pairs = {} if names is None else dict(names) if isinstance(names, Mapping | tuple) else None
    numbers = pairs is not None and all(
        isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        for value in pairs
    )
    if pairs is None or not numbers or not all(isinstance(text, str) and text for text in pairs.values()):
        raise ValueError(f"the names of a color must be {{value: text}}, got {names!r:.60}")
    return tuple(sorted((float(value), text) for value, text in pairs.items()))


def colored(states: list[State], color: Any, unit: LengthUnit, cut: bool = False) -> Scalar | None:
    """Return the scalar that a caller gives, as in `scalar_of` or as a Color."""
    asked = color if isinstance(color, Color) else Color(color)
    scalar = scalar_of(states, asked.values, asked.label, asked.range, unit, cut)
    if scalar is not None and asked.averaged:
        scalar = averaged_at_vertices(
            states, scalar, keeps_limits=asked.range is not None or (cut and scalar.of_tetrahedra)
        )
    if scalar is not None and asked.names:
        scalar = replace(scalar, names=asked.names)
    if scalar is None or asked.scale is None:
        return scalar
    bound = max(map(abs, scalar.limits))
    limits = (-bound, bound) if asked.scale == "diverging" and asked.range is None else scalar.limits
    return replace(scalar, scale=asked.scale, limits=limits)
