"""The frames of a movie, with one view, one scale and one position of the field's arrow for the whole motion."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..results.state import State
from ..results.units import LengthUnit, prefixed
from . import colors, glyphs
from .colors import Scalar, rgb
from .panels import (
    LONGEST_FIELD,
    Drawing,
    Options,
    Panel,
    contact_solid,
    contacts_key,
    field_arrow,
    field_label,
    magnetization_key,
    magnetization_solids,
    sheet_solids,
    size_of,
    sources_key,
    strongest_contact,
)
from .picture import paint, paint_panel, screen_of, title_height
from .playback import SAMPLES, evenly_spaced
from .solids import arrows
from .surroundings import box_of, obstacle_solids
from .texts import Ruler
from .view import View

DPI = 140


class Scenery:
    """The properties that all frames of a motion share, such as scales and the window, and the drawing of each frame.

    states: all states of the motion.
    """

    options: Options
    scalar: Scalar | None
    unit: LengthUnit
    view: View

    def __init__(
        self, states: list[State], scalar: Scalar | None, view: View, unit: LengthUnit, options: Options
    ):
        self.scalar, self.view, self.unit, self.options = scalar, view, unit, options
        self.size: float = size_of(states)
        self.strongest: float = glyphs.largest(states)
        some = evenly_spaced(states, SAMPLES) if options.contacts else []
        self._strongest_contact = strongest_contact(some)
        self._middle = np.concatenate([state.positions for state in states]).mean(axis=0)  # floors stay there
        self._points, self._full_length = self._surroundings(states)
        low, high = self._bounds(states)
        self._prepare_uniform_field(states, low, high)
        self._hold = np.stack([low, high]) @ view.axes

    def drawing(self, state: State, values: np.ndarray | None, title: str) -> Drawing:
        """Return the drawing of a frame. values: those of the scalar in this state, or None."""
        shades = rgb(colors.SHEET)
        if self.scalar is not None and values is not None:
            shades = colors.scale_colors(self.scalar.scale, values, self.scalar.limits)
        panel = Panel(title, sheet_solids(state, shades, self.view, self.size, self.options))
        panel.solids += obstacle_solids([state], self.size, self._middle, self.view.axes[2])
        panel.solids += self._magnetization(state)
        if self._strongest_contact:
            panel.solids.append(contact_solid(state, self._strongest_contact, self.size))
        self._add_fields(panel, state)
        ticks = self.options.ticks
        return Drawing([panel], self.view, self.unit, self.scalar, self._legend(), self._hold, ticks)

    def _legend(self) -> list[tuple[str, str]]:
        shown = [magnetization_key(self.strongest)] if self.options.arrows and self.strongest else []
        shown += [contacts_key(self._strongest_contact)] if self._strongest_contact else []
        return shown + ([sources_key(self._full_length)] if self._full_length else [])

    def _magnetization(self, state: State) -> list[Any]:
        return magnetization_solids(state, self.strongest, self.options.arrows) if self.options.arrows else []

    def _surroundings(self, states: list[State]) -> tuple[np.ndarray, float]:
        """Return the points (n, 3) m at which varying fields are drawn, and the flux density [T] of full length."""
        some = evenly_spaced(states, SAMPLES)
        if not self.options.field or not any(state.has_sources for state in some):
            return np.zeros((0, 3)), 0.0
        points = glyphs.halo(some, self.size)
        return points, glyphs.sources_glyphs(some, [points] * len(some), self.size)[1]

    def _bounds(self, states: list[State]) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner (right, up, towards the eye) of a box around all bodies and arrows, m."""
        points = [state.positions for state in states]
        points += [
            s.positions for state in evenly_spaced(states, SAMPLES) for s in self._magnetization(state)
        ]
        points += [states[0].mesh.rest_positions] if self.options.rest else []
        points += [self._points] if len(self._points) else []
        some, eye = evenly_spaced(states, SAMPLES), self.view.axes[2]
        around = [each.positions for each in obstacle_solids(some, self.size, self._middle, eye)]
        return box_of(*([self.view.project(each) for each in some] for some in (points, around)))

    def _prepare_uniform_field(self, states: list[State], low: np.ndarray, high: np.ndarray) -> None:
        """Choose a position for the uniform field's arrow to the left of the box, and extend the box to contain it."""
        fields = np.array([s.flux_density for s in states if s.flux_density is not None]).reshape(-1, 3)
        magnitude = float(np.linalg.norm(fields, axis=1).max(initial=0.0))
        self._has_uniform = self.options.field and magnitude > 0.0
        if not self._has_uniform:
            return
        self._field_scale = LONGEST_FIELD * self.size / magnitude
        self._field_unit = prefixed(magnitude, "T")
        reach = self._field_scale * np.abs(self.view.project(fields)).max(axis=0)
        gap = 0.07 * self.size
        center = np.array([low[0] - gap - 0.5 * reach[0], *(low[1:] + high[1:]) / 2])
        self._center = center @ self.view.axes
        self._below = (center - [0.0, 0.5 * reach[1] + 0.015 * self.size, 0.0]) @ self.view.axes
        low[0] = center[0] - 0.5 * reach[0]
        low[1] = min(low[1], center[1] - 0.5 * reach[1])
        high[1] = max(high[1], center[1] + 0.5 * reach[1])

    def _add_fields(self, panel: Panel, state: State) -> None:
        if self._has_uniform and state.flux_density is not None:
            panel.solids += field_arrow(self._center, self._field_scale * state.flux_density, self.size)
            factor, unit = self._field_unit
            magnitude = f"{np.linalg.norm(state.flux_density) / factor:.1f} {unit}"
            panel.labels.append(field_label(self._below, magnitude))
        if self._full_length and state.has_sources:
            [around], _ = glyphs.sources_glyphs([state], [self._points], self.size, self._full_length)
            if around is not None:
                panel.solids.append(arrows(around.starts, around.vectors, around.radius, colors.FIELD))


class Reel:
    """A context manager that paints drawings one after the other, with the layout and the legend of the first one.

    The legend is drawn once. matplotlib takes longer to lay out axes than to draw what is in them, so that the contents of
    the panel are drawn one by one over it.
    """

    def __init__(self, first: Drawing, width: int, backend: str):
        self._figure = paint(first, width, 1, backend, DPI).figure
        self._axes = self._figure.axes[0]
        self._window = np.array([*self._axes.get_xlim(), *self._axes.get_ylim()])
        self._title, self._ruler = title_height(self._axes), Ruler(DPI)
        self._screens = screen_of(self._axes, backend, samples=False)
        self._axes.clear()
        self._axes.set_axis_off()
        self._figure.canvas.draw()
        self._legend = self._figure.canvas.copy_from_bbox(self._figure.bbox)

    def __enter__(self) -> Reel:
        self._screen = self._screens.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._screens.__exit__(*error)

    def image(self, drawing: Drawing) -> np.ndarray:
        """Paint a drawing as an image (height, width, 3) uint8, with an even height and width as movies need."""
        axes, canvas = self._axes, self._figure.canvas
        for artist in self._contents():
            artist.remove()
        axes.set_title("")
        panel, room = drawing.panels[0], (self._title, self._ruler)
        paint_panel(axes, panel, drawing, self._window, self._screen, *room)
        canvas.restore_region(self._legend)
        for artist in sorted([*self._contents(), axes.title], key=lambda each: each.get_zorder()):
            artist.draw(canvas.get_renderer())
        image = np.asarray(canvas.buffer_rgba())[:, :, :3]
        odd = [(0, image.shape[k] % 2) for k in (0, 1)]
        return np.pad(image, [*odd, (0, 0)], constant_values=255)

    def _contents(self) -> list[Any]:
        """Return what was painted into the panel."""
        axes = self._axes
        return [*axes.collections, *axes.patches, *axes.lines, *axes.images, *axes.texts]
