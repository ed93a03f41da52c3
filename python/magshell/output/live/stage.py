"""The scene of a browser: parts by name, of which only those that changed are sent again.

viser has no colours of faces, so a coloured surface is divided into patches of one colour each.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..plot import colors, glyphs
from ..plot.colors import Scalar
from ..plot.limits import arrow_count
from ..plot.outlines import outline
from ..plot.style import Style
from ..plot.surroundings import obstacle_solids
from ..plot.view import View
from ..results.state import State

SHOWN_SIZE = (
    2.0  # the size of the bodies in the browser, whose near plane and controls suit lengths of about 1
)
_MARGIN = 1.1  # [-] distance of the eye over that at which a sphere around everything just fits
_ANGLE = 0.75  # [rad] vertical angle of view
_LINES = 1.0  # [pixels] thickness of lines


class Stage:
    """Draws states in a viser server. middle: (3,) m, shown at the origin. size: m, of the bodies.

    Lengths in the browser are those of the model times `scale`.
    """

    def __init__(
        self, server: Any, states: list[State], size: float, style: Style, view: View, sources: np.ndarray
    ):
        """Begin an empty scene, seen from where the bodies and sources at points (k, 3) m fit into the window."""
        points = np.concatenate([*(state.positions for state in states), sources])
        low, high = points.min(axis=0), points.max(axis=0)
        self.middle: np.ndarray = 0.5 * (low + high)
        self.size = size
        self.scale: float = SHOWN_SIZE / size
        self._server, self._style = server, style
        self._strongest = glyphs.largest(states)
        self._field = max(
            (float(np.linalg.norm(s.flux_density)) for s in states if s.flux_density is not None), default=0.0
        )
        self._handles: dict[str, Any] = {}
        server.scene.set_up_direction("+z")
        server.scene.configure_default_lights(
            cast_shadow=False
        )  # half the time of a frame without a graphics card
        camera = server.initial_camera
        camera.fov = _ANGLE
        radius = 0.5 * self.scale * max(float(np.linalg.norm(high - low)), size)
        camera.position = tuple(_MARGIN * radius / np.sin(0.5 * _ANGLE) * view.axes[2])
        camera.look_at = (0.0, 0.0, 0.0)
        if abs(view.elevation) > 89.0:  # up is not seen from above
            camera.up = tuple(view.axes[1])

    def to_view(self, points: np.ndarray) -> np.ndarray:
        """Convert points (..., 3) m to those of the browser."""
        return (np.asarray(points) - self.middle) * self.scale

    def from_view(self, points: np.ndarray) -> np.ndarray:
        """Convert points (..., 3) of the browser to m."""
        return np.asarray(points) / self.scale + self.middle

    def draw(self, state: State, scalar: Scalar | None, number: int) -> None:
        """Draw a state on surfaces, coloured by a scalar's values of state `number`."""
        with self._server.atomic():
            shown = [self._patch(state, each) for each in patches(state.mesh.faces, scalar, number)]
            shown += self._lines(state)
            shown += self._around(state)
            shown += self._arrows(state)
            for name, handle in self._handles.items():
                handle.visible = name in shown

    def put(
        self, name: str, points: np.ndarray, faces: np.ndarray, color: Any, opacity: float | None = None
    ) -> str:
        """Draw a surface: points (n, 3) in the browser, faces (m, 3), colour of three bytes. Return its name."""
        points, handle = points.astype(np.float32), self._handles.get(name)
        if handle is None:
            self._handles[name] = self._server.scene.add_mesh_simple(
                name,
                points,
                faces.astype(np.uint32),
                color=color,
                opacity=opacity,
                side="double",
                cast_shadow=False,
            )
            return name
        handle.vertices = points
        handle.faces = faces.astype(np.uint32)
        return name

    def put_fixed(
        self, name: str, points: np.ndarray, faces: np.ndarray, color: tuple[int, int, int]
    ) -> None:
        """Draw a surface that stays in the frame of its parent in the browser."""
        self._server.scene.add_mesh_simple(
            name,
            points.astype(np.float32),
            faces.astype(np.uint32),
            color=color,
            flat_shading=True,
            side="double",
        )

    def _patch(self, state: State, patch: Any) -> str:
        points = self.to_view(state.positions[patch.vertices])
        return self.put(f"/bodies/{patch.name}", points, patch.faces, patch.color)

    def _lines(self, state: State) -> list[str]:
        mesh = state.mesh
        drawn = {"outline": (state.positions, outline(mesh), colors.OUTLINE)}
        if self._style.mesh_lines:
            drawn["mesh"] = (state.positions, mesh.edges, colors.OUTLINE)
        if self._style.rest:
            drawn["rest"] = (mesh.rest_positions, outline(mesh), colors.REST)
        names = []
        for kind, (points, edges, color) in drawn.items():
            if len(edges):
                names.append(self._segments(f"/lines/{kind}", self.to_view(points[edges]), color))
        return names

    def _segments(self, name: str, points: np.ndarray, color: str) -> str:
        points, handle = points.astype(np.float32), self._handles.get(name)
        if handle is None:
            shade = bytes_of(colors.rgb(color))
            self._handles[name] = self._server.scene.add_line_segments(
                name, points, shade, thickness=_LINES, thickness_units="screen"
            )
        else:
            handle.points = points
        return name

    def _around(self, state: State) -> list[str]:
        """Draw obstacles, magnets that stay, links, tendons, springs and rigid bodies."""
        names = []
        for number, each in enumerate(obstacle_solids([state], self.size, self.middle)):
            shade = bytes_of(each.colors[0])
            opacity = None if each.opacity == 1.0 else each.opacity
            name = f"/around/{number}_{'{:02x}{:02x}{:02x}'.format(*shade)}"
            names.append(self.put(name, self.to_view(each.positions), each.faces, shade, opacity))
        parts = (("links", colors.LINK), ("shapes", colors.LINK))
        parts += (("tendons", colors.TENDON), ("springs", colors.SPRING))
        for kind, color in parts:
            surfaces: Iterable[tuple[np.ndarray, np.ndarray]] = getattr(state, kind)
            for number, (points, faces) in enumerate(surfaces):
                name = f"/{kind}/{number}"
                names.append(self.put(name, self.to_view(points), faces, bytes_of(colors.rgb(color))))
        return names

    def _arrows(self, state: State) -> list[str]:
        """Draw the magnetization on the bodies, and a uniform field beside them."""
        names, count = [], arrow_count(self._style.arrows)
        self._strongest = max(self._strongest, glyphs.largest([state]))
        if count and state.is_magnetized:
            found = glyphs.magnetization_glyphs(state, count, self._strongest)
            if len(found.starts):
                names.append(
                    self._arrow("/arrows/magnetization", found.starts, found.vectors, colors.MAGNETIZATION)
                )
        flux = state.flux_density
        if self._style.show_field and flux is not None and flux.any():
            self._field = max(self._field, float(np.linalg.norm(flux)))
            vector = 0.3 * self.size * flux / self._field
            start = self.middle - [0.65 * self.size, 0.0, 0.0] - 0.5 * vector
            names.append(self._arrow("/arrows/field", start[None], vector[None], colors.FIELD))
        return names

    def _arrow(self, name: str, starts: np.ndarray, vectors: np.ndarray, color: str) -> str:
        points = self.to_view(np.stack([starts, starts + vectors], axis=1)).astype(np.float32)
        handle = self._handles.get(name)
        if handle is not None and handle.points.shape == points.shape:
            handle.points = points
            return name
        longest = self.scale * float(np.linalg.norm(vectors, axis=1).max())
        self._handles[name] = self._server.scene.add_arrows(
            name,
            points,
            bytes_of(colors.rgb(color)),
            shaft_radius=0.05 * longest,
            head_radius=0.12 * longest,
            head_length=0.3 * longest,
        )
        return name


LEVELS = 24  # colours of a scale


class Patch(NamedTuple):
    """The faces of one colour, with their own numbering of vertices.

    color: red, green and blue from 0 to 255. vertices: the number of each of its vertices in the surface, (n,).
    faces: (m, 3), indices into `vertices`.
    """

    name: str
    color: tuple[int, int, int]
    vertices: np.ndarray
    faces: np.ndarray


def patches(faces: np.ndarray, scalar: Scalar | None, state: int) -> list[Patch]:
    """Divide faces (n_f, 3) into patches by the values of a scalar in a state; without a scalar there is one patch."""
    if scalar is None:
        return [_patch(faces, "plain", colors.rgb(colors.SHEET))]
    values = scalar.values[state]
    if len(values) != len(faces):  # at vertices
        values = values[faces].mean(axis=1)
    low, high = scalar.limits
    known = ~np.isnan(values)
    share = np.clip((np.where(known, values, low) - low) / (high - low), 0.0, 1.0)
    levels = np.minimum((share * LEVELS).astype(np.int64), LEVELS - 1)
    middles = low + (np.arange(LEVELS) + 0.5) / LEVELS * (high - low)
    shades = colors.scale_colors(scalar.scale, middles, scalar.limits)
    found = [
        _patch(faces[known & (levels == level)], f"{scalar.scale}_{level}", shades[level])
        for level in np.unique(levels[known])
    ]
    unknown = [] if known.all() else [_patch(faces[~known], "no_value", colors.rgb(colors.NO_VALUE))]
    return [*found, *unknown]


def bytes_of(color: np.ndarray) -> tuple[int, int, int]:
    """Convert a colour (3,) from 0 to 1 to three numbers from 0 to 255."""
    red, green, blue = np.round(255.0 * np.asarray(color)).astype(int).tolist()
    return red, green, blue


def _patch(faces: np.ndarray, name: str, color: np.ndarray) -> Patch:
    vertices, own = np.unique(faces, return_inverse=True)
    return Patch(name, bytes_of(color), vertices, own.reshape(-1, 3))
