"""A finished picture: the panels in rows, and under them axes, scale bar, arrows' legend and colour bar."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from .._checks.scalars import positive
from .._machine.files import replace_file
from ..states.units import round_below
from . import colors, polygons, vtk
from .colors import Scalar, scale_colors
from .limits import check_pixels
from .panels import Drawing, Label, Panel

DPI = 200
LEGEND, TITLE, MARGIN = 0.72, 0.26, 0.08  # inches
FLATTEST, TALLEST = 0.16, 1.1  # of a panel's height to its width
TEXT = 8.0  # points
NARROWEST = 0.8  # inches, of a colour bar
ENOUGH, NARROW = 6.2, 3.4  # inches that a legend with everything takes, and one without arrows or colours
_WITHOUT_WINDOWS = {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}  # of matplotlib's backends


class Picture:
    """A painted drawing. A notebook shows it; `save` writes it, `show` opens a window where there is one.

    figure: the matplotlib Figure, to add to. backend: what painted it.
    """

    def __init__(self, figure, backend: str = "matplotlib"):
        self.figure = figure
        self.backend = backend

    def save(self, path, dpi: float | None = None) -> Path:
        """Writes a PNG. dpi: dots an inch, by default the figure's own. An older file is replaced when it is complete.

        Raises ValueError on another ending or too many pixels, FileNotFoundError or another OSError on a bad folder.
        """
        path = Path(path)
        if path.suffix.lower() != ".png":
            raise ValueError(f"a picture is saved as .png, got {path.name!r}")
        if not path.parent.is_dir():
            raise FileNotFoundError(f"cannot save {path.name!r}: there is no folder {str(path.parent)!r}")
        content = self._repr_png_(dpi)
        replace_file(path, lambda file: file.write(content))
        return path

    def show(self) -> None:
        """Opens a window, or displays in a notebook. Raises RuntimeError where neither is to be had."""
        from matplotlib import pyplot

        backend = pyplot.get_backend().lower()
        if "inline" in backend or "nbagg" in backend:
            from IPython.display import display

            display(self)
            return
        if backend in _WITHOUT_WINDOWS:
            raise RuntimeError("there is no display to show it on: use .save('picture.png')")
        image = pyplot.imread(io.BytesIO(self._repr_png_()))
        window = pyplot.figure(figsize=self.figure.get_size_inches())
        window.figimage(image, resize=True)
        pyplot.show()

    def _repr_png_(self, dpi: float | None = None) -> bytes:
        dpi = self.figure.dpi if dpi is None else positive("dpi", "", dpi)
        check_pixels(*(dpi * self.figure.get_size_inches()), "ask for fewer dots an inch (`dpi`)")
        buffer = io.BytesIO()
        self.figure.savefig(buffer, format="png", dpi=dpi)
        return buffer.getvalue()

    def __repr__(self) -> str:
        width, height = self.figure.canvas.get_width_height()
        return f"Picture({width} x {height} pixels, painted by {self.backend})"


def paint(drawing: Drawing, width: int, columns: int | None, backend: str, dpi: int = DPI) -> Picture:
    """The drawing, `width` pixels wide, in so many columns (None: those that fill the picture best)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(drawing.panels)
    columns = columns or _best_columns(count, drawing.window)
    rows = -(-count // columns)
    inches = width / dpi
    window = _with_room(drawing, (inches - 2 * MARGIN) / columns)
    panel_width = (inches - 2 * MARGIN) / columns
    panel_height = panel_width * (window[3] - window[2]) / (window[1] - window[0])
    title = TITLE if any(panel.title for panel in drawing.panels) else 0.0
    height = rows * (panel_height + title) + LEGEND + 2 * MARGIN
    check_pixels(
        width,
        height * dpi,
        "ask for a smaller `width`, or for fewer `states` or more `columns` if there are many",
    )
    figure = Figure(figsize=(inches, height), dpi=dpi, facecolor="white")
    FigureCanvasAgg(figure)

    for number, panel in enumerate(drawing.panels):
        row, column = divmod(number, columns)
        left = MARGIN + column * panel_width
        bottom = height - MARGIN - (row + 1) * (panel_height + title)
        axes = figure.add_axes((left / inches, bottom / height, panel_width / inches, panel_height / height))
        with screen_of(axes, backend) as screen:
            paint_panel(axes, panel, drawing, window, screen)
    strip = figure.add_axes((0.0, 0.0, 1.0, LEGEND / height))
    _legend(strip, drawing, inches, panel_width / (window[1] - window[0]))
    return Picture(figure, backend)


@contextmanager
def screen_of(axes, backend: str, samples: bool = True) -> Iterator[vtk.Screen | None]:
    """What pyvista paints on before it comes into axes that have their place in the figure; matplotlib needs none."""
    if backend != "pyvista":
        yield None
        return
    box = axes.get_window_extent()
    screen = vtk.Screen((round(box.width), round(box.height)), samples)
    try:
        yield screen
    finally:
        screen.close()


def paint_panel(axes, panel: Panel, drawing: Drawing, window, screen: vtk.Screen | None) -> None:
    """Into axes that have their place in the figure, by pyvista if there is a screen."""
    axes.set_axis_off()
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    if screen is not None:
        vtk.paint(axes, panel, drawing.view, window, screen)
    else:
        polygons.paint(axes, panel, drawing.view)
    if panel.title:
        axes.set_title(panel.title, fontsize=TEXT + 1, color=colors.OUTLINE, pad=4)
    for label in panel.labels:
        _write(axes, label, drawing)


def _write(axes, label: Label, drawing: Drawing) -> None:
    from matplotlib.patheffects import withStroke

    axes.annotate(
        label.text,
        drawing.view.project(label.point)[:2],
        xytext=(4 * label.towards[0], 4 * label.towards[1]),
        textcoords="offset points",
        ha=_side(label.towards[0], "right", "left"),
        va=_side(label.towards[1], "top", "bottom"),
        fontsize=TEXT,
        color=label.color,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _side(towards: float, behind: str, ahead: str) -> str:
    return "center" if abs(towards) < 0.5 else ahead if towards > 0 else behind


def _with_room(drawing: Drawing, inches: float) -> np.ndarray:
    """The window of a panel this wide, with room for its labels' text and of a bearable shape."""
    left, right, bottom, top = drawing.window
    for _ in range(2):  # the room for text is in inches, which the first pass finds the scale for
        scale = (right - left) / inches
        for panel in drawing.panels:
            for label in panel.labels:
                x, y, _depth = drawing.view.project(label.point)
                long, high = scale * 0.075 * len(label.text), scale * 0.22
                x, y = x + 0.5 * long * label.towards[0], y + 0.5 * high * label.towards[1]
                left, right = min(left, x - long / 2), max(right, x + long / 2)
                bottom, top = min(bottom, y - high / 2), max(top, y + high / 2)
    width, height = right - left, top - bottom
    extra = max(FLATTEST * width - height, 0.0) / 2
    bottom, top = bottom - extra, top + extra
    extra = max((top - bottom) / TALLEST - width, 0.0) / 2
    return np.array([left - extra, right + extra, bottom, top])


def _best_columns(count: int, window: np.ndarray) -> int:
    """Columns for a picture about twice as wide as high, with few empty places."""
    shape = (window[1] - window[0]) / (window[3] - window[2])
    shape = min(shape, 1.0 / FLATTEST)

    def cost(columns: int) -> float:
        rows = -(-count // columns)
        return abs(np.log(columns * shape / rows / 2.0)) + 2.0 * (rows * columns / count - 1.0)

    return min(range(1, count + 1), key=cost)


def _legend(axes, drawing: Drawing, inches: float, inches_per_meter: float) -> None:
    """In inches: the axes' triad, the scale bar, the meaning of the arrows, the colour bar. All of it is smaller where the
    picture is too narrow for them."""
    full = drawing.arrows and drawing.scalar is not None
    shrunk = min(1.0, inches / (ENOUGH if full else NARROW))
    inches, inches_per_meter, text_size = inches / shrunk, inches_per_meter / shrunk, TEXT * shrunk
    axes.set_axis_off()
    _set_inches(axes, inches, shrunk)
    _triad(axes, drawing, np.array([0.36, 0.32]), text_size)
    bar = round_below(min(1.2, 0.2 * inches) / inches_per_meter)
    x = 0.85
    end = x + bar * inches_per_meter
    axes.plot([x, end], [0.36, 0.36], color=colors.OUTLINE, linewidth=2.0, solid_capstyle="butt")
    text = f"{round(bar / drawing.unit.meters, 9):g} {drawing.unit.name}"
    axes.text((x + end) / 2, 0.28, text, ha="center", va="top", fontsize=text_size, color=colors.OUTLINE)
    x = max(end, x + 0.5) + 0.35
    for row, (text, color) in enumerate(drawing.arrows):
        y = 0.36 + (0.11 - 0.22 * row if len(drawing.arrows) > 1 else 0.0)
        axes.annotate(
            "",
            (x + 0.3, y),
            (x, y),
            arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0},
        )
        written = axes.text(
            x + 0.38, y, text, ha="left", va="center", fontsize=text_size, color=colors.OUTLINE
        )
        end = max(end, written.get_window_extent().x1 / axes.figure.dpi / shrunk)
    if drawing.scalar is not None:
        _color_bar(axes, drawing.scalar, inches, inches - end - 0.45, text_size, shrunk)


def _set_inches(axes, inches: float, shrunk: float) -> None:
    axes.set_xlim(0.0, inches)
    axes.set_ylim(0.0, LEGEND / shrunk)


def _triad(axes, drawing: Drawing, origin: np.ndarray, text_size: float) -> None:
    for name, tip in zip("xyz", 0.24 * drawing.view.axes[:2].T, strict=True):
        if np.linalg.norm(tip) < 0.03:  # it points at the eye
            continue
        axes.annotate(
            "",
            origin + tip,
            origin,
            arrowprops={
                "arrowstyle": "-|>",
                "color": colors.OUTLINE,
                "linewidth": 0.9,
                "shrinkA": 0,
                "shrinkB": 0,
                "mutation_scale": 6,
            },
        )
        place = origin + tip * (1 + 0.07 / np.linalg.norm(tip))
        axes.text(*place, name, ha="center", va="center", fontsize=text_size - 1, color=colors.OUTLINE)


def _color_bar(axes, scalar: Scalar, inches: float, room: float, text_size: float, shrunk: float) -> None:
    """At the right end; room: inches that nothing else has, of which it takes what it needs to be read at least."""
    from matplotlib.ticker import MaxNLocator

    low, high = scalar.limits
    width = max(min(2.4, 0.32 * inches, room), NARROWEST)
    left, right = inches - width - 0.3, inches - 0.3
    shades = scale_colors(scalar.scale, np.linspace(low, high, 256), (low, high))
    axes.imshow(shades[None], extent=(left, right, 0.30, 0.42), aspect="auto", interpolation="bilinear")
    _set_inches(axes, inches, shrunk)
    ticks = [0, 90, 180, 270, 360] if scalar.scale == "cyclic" else MaxNLocator(4).tick_values(low, high)
    for tick in ticks:
        if low - 1e-9 * (high - low) <= tick <= high + 1e-9 * (high - low):
            x = left + (tick - low) / (high - low) * width
            axes.plot([x, x], [0.27, 0.30], color=colors.OUTLINE, linewidth=0.7)
            axes.text(
                x,
                0.25,
                f"{round(tick, 12):g}",
                ha="center",
                va="top",
                fontsize=text_size - 1,
                color=colors.OUTLINE,
            )
    label = axes.text(
        (left + right) / 2,
        0.47,
        scalar.label,
        ha="center",
        va="bottom",
        fontsize=text_size,
        color=colors.OUTLINE,
    )
    if label.get_window_extent().x1 / axes.figure.dpi / shrunk > inches - 0.05:  # it is longer than the bar
        label.set(x=inches - 0.05, ha="right")
