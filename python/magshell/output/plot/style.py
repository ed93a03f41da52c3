"""How pictures, movies and pages look: made once, and handed to as many of them as are to look alike."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..._input.scalars import flag
from ..._runtime.frozen import immutable
from ..results.state import State
from ..results.units import LengthUnit
from .backend import BACKENDS
from .colors import SCALES, Scalar, scalar_of
from .limits import arrow_count


@immutable
@dataclass(frozen=True)
class Style:
    """What is drawn beside the bodies, and by whom: `style` of ms.plot, ms.animate and ms.write_page.

    arrows: magnetization F_0 M_r as arrows, about 60 on a sheet, or as many as you say.
    show_field: a uniform field as one arrow beside the sheet, one that varies as arrows around it.
    rest: the rest shape as a faint outline. mesh_lines: the edges of the mesh.
    contacts: the forces of all contacts, friction included, as arrows from the vertices on which they act, over everything.
    backend: "pyvista" or "matplotlib"; by default the environment variable MAGSHELL_PLOT, else pyvista where it can render
        off the screen, else matplotlib. A page is painted by the browser that shows it.

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
    backend: str | None = None

    def __post_init__(self) -> None:
        arrow_count(self.arrows)
        for name in ("show_field", "rest", "mesh_lines", "contacts"):
            flag(name, getattr(self, name))
        if self.backend is not None and self.backend not in BACKENDS:
            raise ValueError(f"backend must be 'pyvista' or 'matplotlib', got {self.backend!r:.60}")


def style_of(style: Style | None) -> Style:
    """Of a caller, None for the default. Raises ValueError."""
    if style is None:
        return Style()
    if not isinstance(style, Style):
        raise ValueError(f"style must be an ms.Style, got {style!r:.60}")
    return style


@immutable
@dataclass(frozen=True)
class Color:
    """A quantity that colours bodies, with its own text, ends and scale: `color` of ms.plot, ms.animate and ms.write_page,
    where several pictures are to have the same, or where the usual ones will not do.

    values: what `color` of ms.plot takes: a name, or numbers of faces or vertices. label: the text at the colour bar, with
    the unit. range: (low, high), in the unit of the values; by default what there is. scale: "sequential", "diverging"
    (even on both sides of 0 unless there is a range) or "cyclic"; by default what suits a name, "sequential" for numbers.

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

    def __post_init__(self) -> None:
        if isinstance(self.values, np.ndarray):
            object.__setattr__(self, "values", self.values.copy())
        if not isinstance(self.label, str | None):
            raise ValueError(f"the label of a color must be a string, got {self.label!r:.60}")
        if self.scale is not None and self.scale not in SCALES:
            raise ValueError(
                f"the scale of a color must be {', '.join(SCALES)} or None, got {self.scale!r:.60}"
            )


def colored(states: list[State], color: Any, unit: LengthUnit, cut: bool = False) -> Scalar | None:
    """The scalar that a caller asks for, as in `scalar_of`, or by a Color."""
    asked = color if isinstance(color, Color) else Color(color)
    scalar = scalar_of(states, asked.values, asked.label, asked.range, unit, cut)
    if scalar is None or asked.scale is None:
        return scalar
    bound = max(map(abs, scalar.limits))
    limits = (-bound, bound) if asked.scale == "diverging" and asked.range is None else scalar.limits
    return replace(scalar, scale=asked.scale, limits=limits)
