"""The content of a picture before it is painted: panels of solids and labels, with one view and one scale."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from ...mesh.triangles.thickened import thickened
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State
from ..results.units import LengthUnit, with_unit
from . import colors, glyphs
from .colors import Scalar, rgb
from .cuts import Cut, Section, cut_edges, opened, section_solid
from .limits import arrow_count
from .outlines import outline_edges, seen, silhouettes
from .solids import Solid, arrows, ribbons, sheet
from .style import Style
from .surroundings import box_of, inner_solids, obstacle_solids
from .view import View

LINE = 0.0022  # [-] width of lines over the size of the drawing
LONGEST_FIELD = 0.2  # [-] longest arrow of a uniform field over the size of the drawing
LONGEST_CONTACT = 0.12  # [-] longest arrow of a contact force over the size of the drawing
FLESH = 0.45  # [-] opacity of bodies with links or tendons inside
MOST_ARROWS = 4  # uniform fields in a panel that are drawn side by side; more are a fan
PALEST = 0.8  # [-] fraction of white in the first of many states that fade


@dataclass(frozen=True)
class Label:
    """A text next to a point (3,) m, on the side in the direction `towards` (right, up)."""

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
    """A complete picture for layout and painting.

    arrows: the keys of arrows in the legend, (text, colour) each. hold: points (n, 3) m that the window must contain, in
    addition to the solids. ticks: whether the window has ticks with coordinates.
    """

    panels: list[Panel]
    view: View
    unit: LengthUnit
    scalar: Scalar | None
    arrows: list[tuple[str, str]]
    hold: np.ndarray | None = None
    ticks: bool = False

    @property
    def window(self) -> np.ndarray:
        """The window on the screen, (left, right, bottom, top) m.

        It contains the bodies of all panels, and as much of their surroundings as leaves the bodies large.
        """
        if self.view.corners is not None:
            framed = self.view.project(self.view.corners)[:, :2]
            return np.stack([framed.min(axis=0), framed.max(axis=0)], axis=1).ravel()
        held = [] if self.hold is None else [self.hold]
        solids = [solid for panel in self.panels for solid in panel.solids]
        held += [solid.positions for solid in solids if not solid.around]
        around = [] if self.hold is not None else [solid.positions for solid in solids if solid.around]
        low, high = box_of(*([self.view.project(each)[:, :2] for each in some] for some in (held, around)))
        margin = 0.03 * (high - low).max()
        return np.array([low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin])


@dataclass(frozen=True)
class Options:
    """The things to draw in addition to the bodies."""

    arrows: int = glyphs.ARROWS  # 0 for none
    field: bool = True
    rest: bool = False
    mesh_lines: bool = False
    fade: bool = False  # earlier states in a panel are paler
    cut: Cut | None = None
    sections: tuple[Section, ...] = ()  # one per state, if there is a cut
    contacts: bool = False  # contact forces as arrows
    ticks: bool = False  # coordinates along the edges of the window
    thickness: bool = False  # shells as closed surfaces

    @classmethod
    def of(cls, style: Style) -> Options:
        """Make the options from a caller's style."""
        count = arrow_count(style.arrows)
        more = {name: getattr(style, name) for name in ("contacts", "ticks", "thickness")}
        return cls(count, style.show_field, style.rest, style.mesh_lines, **more)


def draw(
    groups: list[list[State]],
    titles: list[str],
    scalar: Scalar | None,
    view: View,
    unit: LengthUnit,
    options: Options,
) -> Drawing:
    """Draw one panel per group of states; the states of a group lie over each other."""
    states = [state for group in groups for state in group]
    size = size_of(states)
    middle = np.concatenate([state.positions for state in states]).mean(
        axis=0
    )  # the same floor in all panels
    legend: list[tuple[str, str]] = []
    panels = []
    for number, group in enumerate(groups):
        panel = Panel(titles[number] if len(groups) > 1 or len(group) == 1 else "")
        first = sum(map(len, groups[:number]))
        for index, (state, paleness) in enumerate(zip(group, _paleness(len(group), options), strict=True)):
            series = 0 if options.fade else index % len(colors.SERIES)
            plain = colors.SERIES[series] if len(group) > 1 else colors.SHEET
            shades = rgb(plain) if scalar is None else scalar.colors(first + index)
            solids = sheet_solids(state, shades, view, size, options)
            if options.cut is not None:
                solids = [opened(each, options.cut) for each in solids]
                solids += _section_solids(state, first + index, scalar, view, size, options)
                solids = [each for each in solids if len(each.faces)]
            panel.solids += _pale(solids, paleness)
        panel.solids += obstacle_solids(group, size, middle, view.axes[2])
        if len(group) > 1:
            labels = _series_labels(group, titles, view)
            panel.labels += _apart(labels, view, 0.1 * size) if options.fade else labels
        panels.append(panel)
    if options.arrows and any(state.is_magnetized for state in states):
        strongest = glyphs.largest(states)
        for panel, group in zip(panels, groups, strict=True):
            for state, paleness in zip(group, _paleness(len(group), options), strict=True):
                chosen = magnetization_solids(state, strongest, options.arrows, options.cut)
                panel.solids += _pale(chosen, paleness)
        legend.append(magnetization_key(strongest))
    if options.contacts:
        legend += _contacts(panels, groups, size, options)
    if options.field:
        _uniform_fields(panels, groups, view, size, options)
        legend += _sources(panels, groups, size)
    return Drawing(panels, view, unit, scalar, legend, ticks=options.ticks)


def size_of(states: list[State]) -> float:
    """Return the diagonal of the box around the bodies and their rest shapes, m."""
    points = np.concatenate([x for state in states for x in (state.positions, state.mesh.rest_positions)])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def sheet_solids(state: State, shades: np.ndarray, view: View, size: float, options: Options) -> list[Solid]:
    """Return the solids of a state's bodies, with links, tendons, springs, rigid bodies and lines.

    shades: colours of the bodies.
    """
    mesh, eye = state.mesh, view.axes[2]
    step = float(mesh.edge_lengths.mean())
    skins, border = [sheet(state.positions, mesh.faces, shades)], None
    if options.thickness and state.thickness is not None:
        skins, border = thick_skins(state, shades)
    if state.links or state.tendons:
        skins = [replace(skin, opacity=FLESH) for skin in skins]
    solids = [*(solid for _, solid in inner_solids(state)), *skins]
    if options.mesh_lines:
        edges = mesh.edges[seen(state, np.arange(mesh.n_edges), eye)]
        solids.append(ribbons(state.positions[edges], eye, 0.5 * LINE * size, colors.OUTLINE, 0.6 * step))
    lines = outline_edges(mesh)
    if border is not None:
        solids.append(ribbons(border, eye, LINE * size, colors.OUTLINE, 0.2 * step))
    if border is None:
        contours = [state.positions[mesh.edges[seen(state, lines, eye)]], silhouettes(state, eye)]
        solids.append(ribbons(np.concatenate(contours), eye, LINE * size, colors.OUTLINE, 0.8 * step))
    if len(state.creases):
        creases = state.positions[np.asarray(state.creases)]
        solids.append(ribbons(creases, eye, 1.4 * LINE * size, colors.CREASE, 0.8 * step))
    if options.rest and state.displacements.any():
        lines = mesh.edges[lines] if len(lines) else mesh.edges
        solids.append(ribbons(mesh.rest_positions[lines], eye, 0.8 * LINE * size, colors.REST, 0.0))
    return solids


def _section_solids(
    state: State, number: int, scalar: Scalar | None, view: View, size: float, options: Options
) -> list[Solid]:
    """Return the section of state `number` as solids: the part of the plane inside solids, and its edges."""
    found, step, eye = options.sections[number], float(state.mesh.edge_lengths.mean()), view.axes[2]
    solids = [section_solid(found, options.cut, scalar, number)]
    if options.mesh_lines:
        lines = found.points[found.lines]
        solids.append(ribbons(lines, eye, 0.5 * LINE * size, colors.OUTLINE, 0.6 * step))
    return [*solids, ribbons(cut_edges(state, options.cut), eye, LINE * size, colors.OUTLINE, 0.8 * step)]


def magnetization_solids(state: State, strongest: float, count: int, cut: Cut | None = None) -> list[Solid]:
    """Return about `count` arrows of the magnetization, without those on the removed side of a cut."""
    if not state.is_magnetized:
        return []
    chosen = glyphs.magnetization_glyphs(state, count, strongest)
    starts, vectors = chosen.starts, chosen.vectors
    if cut is not None:
        visible = cut.heights(starts + 0.5 * vectors) <= 0
        starts, vectors = starts[visible], vectors[visible]
    return [arrows(starts, vectors, chosen.radius, colors.MAGNETIZATION, chosen.lift)]


def _paleness(count: int, options: Options) -> list[float]:
    """Return the paleness of each of `count` states in one panel, from 0 to 1."""
    fading = options.fade and count > 1
    return [PALEST * (1.0 - k / (count - 1)) if fading else 0.0 for k in range(count)]


def _pale(solids: list[Solid], paleness: float) -> list[Solid]:
    return [replace(solid, colors=paleness + (1.0 - paleness) * solid.colors) for solid in solids]


def _uniform_fields(
    panels: list[Panel], groups: list[list[State]], view: View, size: float, options: Options
) -> None:
    """Add an arrow of the uniform field to the left of the bodies in each panel, and its magnitude.

    The length of the arrow is proportional to the field.
    """
    strongest = max((_magnitude(state) for group in groups for state in group), default=0.0)
    if strongest == 0.0:
        return
    scale = LONGEST_FIELD * size / strongest
    right, up, eye = view.axes
    solids = [solid for panel in panels for solid in panel.solids]
    some = ([view.project(s.positions) for s in solids if s.around is around] for around in (False, True))
    low, high = box_of(*some)
    left, middle = low[0], (low + high) / 2.0
    for panel, group in zip(panels, groups, strict=True):
        fields = _distinct([s.flux_density for s in group if s.flux_density is not None])
        x = left - 0.07 * size
        if len(fields) > (1 if options.fade else MOST_ARROWS):
            _fan(panel, np.array(fields), scale, x * right + middle[1] * up + middle[2] * eye, view, size)
            fields = []
        for flux_density in fields:
            vector = scale * flux_density
            width = abs(vector @ right)
            center = (x - 0.5 * width) * right + middle[1] * up + middle[2] * eye
            panel.solids += field_arrow(center, vector, size)
            low = center - (0.5 * abs(vector @ up) + 0.015 * size) * up
            panel.labels.append(field_label(low, with_unit(float(np.linalg.norm(flux_density)), "T")))
            x -= width + 0.12 * size


def _fan(panel: Panel, fields: np.ndarray, scale: float, point: np.ndarray, view: View, size: float) -> None:
    """Add successive uniform fields (n, 3) T as arrows from a common start, to the left of a point (3,) m."""
    right, up, _ = view.axes
    vectors = scale * fields
    reach = np.vstack([view.project(vectors), np.zeros(3)])
    low, high = reach.min(axis=0), reach.max(axis=0)
    tail = point - high[0] * right - 0.5 * (low[1] + high[1]) * up
    for vector, paleness in zip(vectors, _paleness(len(vectors), Options(fade=True)), strict=True):
        panel.solids += _pale(field_arrow(tail + 0.5 * vector, vector, size), paleness)
    middle = tail + 0.5 * (low[0] + high[0]) * right + (low[1] - 0.015 * size) * up
    strongest = with_unit(float(np.linalg.norm(fields, axis=1).max()), "T")
    panel.labels.append(Label(middle, f"$B$ up to {strongest}", colors.FIELD, (0.0, -1.0)))


def field_label(point: np.ndarray, magnitude: str) -> Label:
    """Return the label under the arrow of a uniform field."""
    return Label(point, f"$B$ = {magnitude}", colors.FIELD, (0.0, -1.0))


def field_arrow(center: np.ndarray, vector: np.ndarray, size: float) -> list[Solid]:
    """Return the arrow of a uniform field with a vector (3,) m and a center (3,) m; an empty list if it is zero."""
    if not vector.any():
        return []
    return [arrows(center[None] - vector / 2, vector[None], 0.0065 * size, colors.FIELD)]


def _magnitude(state: State) -> float:
    return 0.0 if state.flux_density is None else float(np.linalg.norm(state.flux_density))


def _distinct(vectors: list[np.ndarray]) -> list[np.ndarray]:
    return list({tuple(np.round(v, 12).tolist()): v for v in vectors}.values())


def _sources(panels: list[Panel], groups: list[list[State]], size: float) -> list[tuple[str, str]]:
    """Add arrows of the fields that vary in space to each panel. Returns their keys in the legend."""
    points = [glyphs.halo(group, size) if group[-1].has_sources else np.zeros((0, 3)) for group in groups]
    around, strong = glyphs.sources_glyphs([group[-1] for group in groups], points, size)
    for panel, chosen in zip(panels, around, strict=True):
        if chosen is not None:
            panel.solids.append(arrows(chosen.starts, chosen.vectors, chosen.radius, colors.FIELD))
    return [sources_key(strong)] if strong else []


def _contacts(panels: list[Panel], groups: list[list[State]], size: float, options: Options):
    """Add arrows of the contact forces to each panel. Returns their keys in the legend; none without contact."""
    strongest = strongest_contact([state for group in groups for state in group])
    if strongest == 0.0:
        return []
    for panel, group in zip(panels, groups, strict=True):
        for state, paleness in zip(group, _paleness(len(group), options), strict=True):
            panel.solids += _pale([contact_solid(state, strongest, size)], paleness)
    return [contacts_key(strongest)]


def strongest_contact(states: list[State]) -> float:
    """Return the largest contact force on a vertex in all states, N."""
    forces = [glyphs.contact_forces(state).forces for state in states]
    return max((float(np.linalg.norm(each, axis=1).max(initial=0.0)) for each in forces), default=0.0)


def contact_solid(state: State, strongest: float, size: float) -> Solid:
    """Return arrows of the contact forces in a state."""
    found = glyphs.contact_forces(state)
    vectors = LONGEST_CONTACT * size / strongest * found.forces
    return arrows(found.positions, vectors, 0.003 * size, colors.CONTACT, 0.5 * size)


def contacts_key(strongest: float) -> tuple[str, str]:
    """Return the key of contact forces in the legend, (text, colour)."""
    return f"contact force, up to {with_unit(strongest, 'N')}", colors.CONTACT


def magnetization_key(strongest: float) -> tuple[str, str]:
    """Return the key of the magnetization in the legend, (text, colour)."""
    return f"$M_r$, up to {with_unit(strongest, 'A/m')}", colors.MAGNETIZATION


def sources_key(full_length: float) -> tuple[str, str]:
    """Return the key of fields that vary in space in the legend, (text, colour)."""
    return f"$B$, full length at {with_unit(full_length, 'T')}", colors.FIELD


def _series_labels(group: list[State], titles: list[str], view: View) -> list[Label]:
    """Return a label with each state's title, at the vertex that is farthest from the other states on the screen."""
    labels = []
    screens = [view.project(state.positions)[:, :2] for state in group]
    for state, screen, title in zip(group, screens, titles, strict=True):
        others = np.concatenate([other for other in screens if other is not screen])
        distance, nearest = scipy.spatial.cKDTree(others).query(screen)
        vertex = int(np.argmax(distance))
        away = (screen[vertex] - others[nearest[vertex]]) / max(distance[vertex], 1e-300)
        if title:
            labels.append(
                Label(state.positions[vertex], title, colors.OUTLINE, (float(away[0]), float(away[1])))
            )
    return labels


def _apart(labels: list[Label], view: View, distance: float) -> list[Label]:
    """Choose labels at least a distance [m] apart on the screen; the last one and the first take precedence."""
    chosen: list[Label] = []
    for label in [*labels[-1:], *labels[:-1]]:
        gaps = [np.linalg.norm(view.project(label.point - other.point)[:2]) for other in chosen]
        if min(gaps, default=np.inf) >= distance:
            chosen.append(label)
    return chosen


def thick_skins(state: State, shades: np.ndarray) -> tuple[list[Solid], np.ndarray]:
    """Return the sides of shells, their walls, and the surfaces of solids; and the border lines (k, 2, 3) m of the walls.

    state: on surfaces. shades: (3,), or colours of its faces or vertices, (n_f, 3) or (n_v, 3); colours of vertices become
    those of faces. Raises ValueError, with the face, for a shell that bends more sharply than its thickness allows.
    """
    mesh, thickness = state.mesh, state.thickness()
    if shades.ndim == 1:
        shades = np.broadcast_to(shades, (mesh.n_faces, 3))
    elif len(shades) != mesh.n_faces:
        shades = shades[mesh.faces].mean(axis=1)
    thick = thickness > 0.0
    solids = [sheet(state.positions, mesh.faces[~thick], shades[~thick])] if not thick.all() else []
    if not thick.any():
        return solids, np.zeros((0, 2, 3))
    used, faces = np.unique(mesh.faces[thick], return_inverse=True)
    shell = TriangleMesh(mesh.rest_positions[used], faces.reshape(-1, 3))
    points, all_faces = thickened(shell, state.positions[used], thickness[thick])
    sides, walls = all_faces[: 2 * shell.n_faces], all_faces[2 * shell.n_faces :]
    own = shades[thick]
    behind = np.nonzero((shell.edge_faces < 0).any(axis=1)[shell.face_edges])[
        0
    ]  # the face of each pair of walls
    solids.append(sheet(points, sides, np.concatenate([own, own])))
    if len(walls):
        solids.append(replace(sheet(points, walls, np.concatenate([own[behind], own[behind]])), smooth=False))
    half = len(walls) // 2
    ends = np.concatenate([walls[:half][:, [0, 1]], walls[half:][:, [1, 2]]])
    return solids, points[ends]
