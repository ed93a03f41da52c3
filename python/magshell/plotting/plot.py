"""ms.plot: a picture of sheets."""

from __future__ import annotations

from .. import _arrays
from . import backend as backends
from .colors import scalar_of
from .glyphs import ARROWS
from .panels import Options, draw, size_of
from .picture import Picture, paint
from .states import states_of
from .units import length_unit
from .view import view_of


def plot(
    what,
    *,
    positions=None,
    remanent_magnetization=None,
    applied_flux_density=None,
    field=None,
    color="auto",
    color_label: str | None = None,
    color_range=None,
    arrows: bool | int = True,
    show_field: bool = True,
    rest: bool = False,
    mesh_lines: bool = False,
    titles=None,
    overlay: bool = False,
    columns: int | None = None,
    view=None,
    width: int = 1600,
    backend: str | None = None,
) -> Picture:
    """A picture of a sheet, its magnetization and the field; of several, side by side or over each other.

    what: a mesh, a Shell, a Scene, a result, or a list of those.
    positions, remanent_magnetization, applied_flux_density, field: (n_v, 3) m, (n_f, 3) A/m, (3,) T and fields that
        vary in space, for a mesh, which has none, or instead of a result's own.
    color: "magnetization" (the component of M_r along the axis that all of it shares, else its angle or magnitude),
        "displacement", "magnetic_energy" (a rest volume), an array with a number a face or a vertex, a list of such
        arrays, one a state, or None for plain sheets. "auto": magnetization if it varies, else displacement.
    color_label, color_range: the text, with the unit, and the ends of the colour bar.
    arrows: magnetization F_0 M_r as arrows, about 60 on a sheet, or as many as you say.
    show_field: a uniform field as one arrow beside the sheet, one that varies as arrows around it.
    rest: the rest shape as a faint outline. mesh_lines: the edges of the mesh.
    titles: one a state. overlay: all states in one panel. columns: of panels, by default what fills the picture.
    view: (elevation, azimuth) in degrees of the eye, as in matplotlib; by default what suits the sheet.
    width: pixels. backend: "pyvista" or "matplotlib"; by default the environment variable MAGSHELL_PLOT, else pyvista
        where it can render off the screen, else matplotlib.

    Raises ValueError on bad input, ImportError without matplotlib.

    >>> import magshell as ms
    >>> ms.plot(ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)), backend="matplotlib", width=800)
    Picture(800 x 287 pixels, painted by matplotlib)
    """
    painter = backends.choose(backend)
    states = states_of(
        what,
        positions=positions,
        remanent_magnetization=remanent_magnetization,
        applied_flux_density=applied_flux_density,
        field=field,
    )
    titles = checked_titles(titles, len(states))
    unit = length_unit(size_of(states))
    scalar = scalar_of(states, color, color_label, color_range, unit)
    count = ARROWS if arrows is True else _arrays.index_array("arrows", int(arrows)).item()
    if count < 0:
        raise ValueError(f"arrows must be True, False or a count, got {arrows}")
    if width < 400 or (columns is not None and columns < 1):
        raise ValueError(
            f"width must be at least 400 pixels and columns at least 1, got {width} and {columns}"
        )
    groups = [states] if overlay else [[state] for state in states]
    options = Options(count, show_field, rest, mesh_lines)
    drawing = draw(groups, titles, scalar, view_of(states, view), unit, options)
    return paint(drawing, width, columns, painter)


def checked_titles(titles, count: int) -> list[str]:
    """One title a state, empty ones by default."""
    if titles is None:
        return [""] * count
    listed = [titles] if isinstance(titles, str) else list(titles)
    if len(listed) != count or not all(isinstance(title, str) for title in listed):
        raise ValueError(f"titles must be {count} strings, one a state, got {titles!r}")
    return listed
