"""A picture before it is painted: panels of solids and labels, seen from one direction at one scale."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from ..mesh import TriangleMesh
from . import colors, glyphs
from .colors import Scalar, rgb
from .solids import Solid, arrows, ribbons, sheet
from .states import State
from .units import LengthUnit, with_unit
from .view import View

CREASE = np.cos(np.radians(40.0))  # rest edges that turn by more are drawn as lines
LINE = 0.0022  # width, in sizes of the drawing


@dataclass(frozen=True)
class Label:
    """Text beside a point (3,), m, on the side that `towards` (right, up) says."""

    point: np.ndarray
    text: str
    color: str
    towards: tuple[float, float] = (0.0, 1.0)


@dataclass
class Panel:
    title: str = ""
    solids: list[Solid] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)


@dataclass(frozen=True)
class Drawing:
    """All that a painter and the layout need. `arrows`: what the legend says about arrows: (text, colour)."""

    panels: list[Panel]
    view: View
    unit: LengthUnit
    scalar: Scalar | None
    arrows: list[tuple[str, str]]

    @property
    def window(self) -> np.ndarray:
        """(left, right, bottom, top), m, on the screen: holds every panel."""
        points = [self.view.project(s.positions)[:, :2] for panel in self.panels for s in panel.solids]
        low, high = (
            np.min([p.min(axis=0) for p in points], axis=0),
            np.max([p.max(axis=0) for p in points], axis=0),
        )
        margin = 0.03 * (high - low).max()
        return np.array([low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin])


@dataclass(frozen=True)
class Options:
    """What to draw beside the sheets."""

    arrows: int = glyphs.ARROWS  # 0 for none
    field: bool = True
    rest: bool = False
    mesh_lines: bool = False


def draw(
    groups: list[list[State]],
    titles: list[str],
    scalar: Scalar | None,
    view: View,
    unit: LengthUnit,
    options: Options,
) -> Drawing:
    """One panel a group of states; the states of a group lie over each other."""
    states = [state for group in groups for state in group]
    size = size_of(states)
    legend: list[tuple[str, str]] = []
    panels = []
    for number, group in enumerate(groups):
        panel = Panel(titles[number] if len(groups) > 1 or len(group) == 1 else "")
        first = sum(map(len, groups[:number]))
        for index, state in enumerate(group):
            plain = colors.SERIES[index % len(colors.SERIES)] if len(group) > 1 else colors.SHEET
            shades = rgb(plain) if scalar is None else scalar.colors(first + index)
            panel.solids += _sheet(state, shades, view, size, options)
        if len(group) > 1:
            panel.labels += _series_labels(group, titles, view)
        panels.append(panel)
    if options.arrows and any(state.is_magnetized for state in states):
        strongest = glyphs.largest(states)
        for panel, group in zip(panels, groups, strict=True):
            for state in group:
                panel.solids += _magnetization(state, strongest, options.arrows)
        legend.append((f"$M_r$, up to {with_unit(strongest, 'A/m')}", colors.MAGNETIZATION))
    if options.field:
        _uniform_fields(panels, groups, view, size)
        legend += _sources(panels, groups, size)
    return Drawing(panels, view, unit, scalar, legend)


def size_of(states: list[State]) -> float:
    """The diagonal of the box around the sheets and their rest shapes, m."""
    points = np.concatenate([x for state in states for x in (state.positions, state.mesh.rest_positions)])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def outline(mesh: TriangleMesh) -> np.ndarray:
    """Edges to draw as lines: those of the boundary, and creases of the rest shape."""
    interior = mesh.interior_edges
    normals = mesh.face_normals[mesh.edge_faces[interior]]
    turn = np.einsum("ei,ei->e", normals[:, 0], normals[:, 1])
    return mesh.edges[np.sort(np.concatenate([mesh.boundary_edges, interior[turn < CREASE]]))]


def _sheet(state: State, shades: np.ndarray, view: View, size: float, options: Options) -> list[Solid]:
    mesh, eye = state.mesh, view.axes[2]
    step = float(mesh.edge_lengths.mean())
    solids = [sheet(state.positions, mesh.faces, shades)]
    if options.mesh_lines:
        solids.append(
            ribbons(state.positions[mesh.edges], eye, 0.5 * LINE * size, colors.OUTLINE, 0.6 * step)
        )
    lines = outline(mesh)
    if len(lines):
        solids.append(ribbons(state.positions[lines], eye, LINE * size, colors.OUTLINE, 0.8 * step))
    if options.rest and state.displacements.any():
        lines = lines if len(lines) else mesh.edges
        solids.append(ribbons(mesh.rest_positions[lines], eye, 0.8 * LINE * size, colors.REST, 0.0))
    return solids


def _magnetization(state: State, strongest: float, count: int) -> list[Solid]:
    if not state.is_magnetized:
        return []
    chosen = glyphs.magnetization_glyphs(state, count, strongest)
    return [arrows(chosen.starts, chosen.vectors, chosen.radius, colors.MAGNETIZATION, chosen.lift)]


def _uniform_fields(panels: list[Panel], groups: list[list[State]], view: View, size: float) -> None:
    """An arrow to the left of the sheets of each panel, as long as the field is strong, and its magnitude."""
    strongest = max((_magnitude(state) for group in groups for state in group), default=0.0)
    if strongest == 0.0:
        return
    longest = 0.2 * size
    right, up, eye = view.axes
    points = np.concatenate([view.project(s.positions) for panel in panels for s in panel.solids])
    left, middle = points[:, 0].min(), (points.min(axis=0) + points.max(axis=0)) / 2.0
    for panel, group in zip(panels, groups, strict=True):
        fields = _distinct([s.flux_density for s in group if s.flux_density is not None])
        place = left - 0.07 * size
        for flux_density in fields:
            vector = flux_density * (longest / strongest)
            width = abs(vector @ right)
            center = (place - 0.5 * width) * right + middle[1] * up + middle[2] * eye
            low = center - (0.5 * abs(vector @ up) + 0.015 * size) * up
            panel.labels.append(
                Label(
                    low,
                    f"$B$ = {with_unit(float(np.linalg.norm(flux_density)), 'T')}",
                    colors.FIELD,
                    (0.0, -1.0),
                )
            )
            if vector.any():
                panel.solids.append(
                    arrows(center[None] - vector / 2, vector[None], 0.0065 * size, colors.FIELD)
                )
            place -= width + 0.12 * size


def _magnitude(state: State) -> float:
    return 0.0 if state.flux_density is None else float(np.linalg.norm(state.flux_density))


def _distinct(vectors: list[np.ndarray]) -> list[np.ndarray]:
    return list({tuple(np.round(v, 12).tolist()): v for v in vectors}.values())


def _sources(panels: list[Panel], groups: list[list[State]], size: float) -> list[tuple[str, str]]:
    """Arrows of the fields that vary in space, and what the legend says."""
    around, strong = glyphs.sources_glyphs(groups, size)
    for panel, chosen in zip(panels, around, strict=True):
        if chosen is not None:
            panel.solids.append(arrows(chosen.starts, chosen.vectors, chosen.radius, colors.FIELD))
    return [(f"$B$, full length at {with_unit(strong, 'T')}", colors.FIELD)] if strong else []


def _series_labels(group: list[State], titles: list[str], view: View) -> list[Label]:
    """Each state's title where it is farthest from the others on the screen, on the side away from them."""
    labels = []
    screens = [view.project(state.positions)[:, :2] for state in group]
    for state, screen, title in zip(group, screens, titles, strict=True):
        others = np.concatenate([other for other in screens if other is not screen])
        distance, nearest = cKDTree(others).query(screen)
        vertex = int(np.argmax(distance))
        away = (screen[vertex] - others[nearest[vertex]]) / max(distance[vertex], 1e-300)
        if title:
            labels.append(
                Label(state.positions[vertex], title, colors.OUTLINE, (float(away[0]), float(away[1])))
            )
    return labels
