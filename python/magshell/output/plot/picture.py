"""Finished pictures: panels in rows with the legend below, and texts that do not overlap."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..._input.scalars import positive
from ..._runtime.files import replace_file
from ..._runtime.frozen import Frozen
from . import colors, legend, polygons, raster, vtk
from .label_layout import NEAR, Box, Room, candidate_centers, text_center
from .legend import TEXT
from .limits import check_pixels
from .panels import Drawing, Label, Panel
from .texts import Ruler
from .ticks import write_ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..._input.kinds import FilePath

Screen: TypeAlias = "polygons.Screen | raster.Screen | vtk.Screen"

DPI = 200
MARGIN = 0.08  # [inch] margin of the picture
# [inch] height of a line of a title, and the gap below it, which is part of the height
TITLE, TITLE_GAP = (0.26, 0.055)
FORMATS = (".png", ".pdf", ".svg")  # endings of the files of pictures
TITLE_LINES = 3  # largest number of lines of a title
FLATTEST, TALLEST = 0.16, 1.1  # [-] smallest and largest ratio of a panel's height to its width
# [inch] distance of the points that represent what texts should not cover, and their largest number along a side of a face
SPREAD, MOST_SPREAD = 0.08, 12
# matplotlib backends that open no window
_WITHOUT_WINDOWS = {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}


class Picture(Frozen):
    """A painted picture, which notebooks display, `save` writes to a file and `show` opens in a window.

    figure: the matplotlib Figure, to which more can be added. backend: the library that painted it.
    """

    def __init__(self, figure: Figure, backend: str = "matplotlib"):
        self.figure = figure
        self.backend = backend

    def save(self, path: FilePath, dpi: float | None = None) -> Path:
        """Write a PNG, PDF or SVG file. dpi: dots per inch, by default those of the figure.

        Texts, curves and what matplotlib painted are vectors in a PDF or SVG; all other bodies are images in it.
        An existing file is replaced once the new one is complete. Raises ValueError for another ending or too many pixels,
        FileNotFoundError if the folder does not exist, and OSError if the file cannot be written.
        """
        path = Path(path)
        if path.suffix.lower() not in FORMATS:
            raise ValueError(f"a picture is saved as {' or '.join(FORMATS)}, got {path.name!r}")
        if not path.parent.is_dir():
            raise FileNotFoundError(f"cannot save {path.name!r}: there is no folder {str(path.parent)!r}")
        content = self._written(path.suffix.lower()[1:], dpi)
        replace_file(path, lambda file: file.write(content))
        return path

    def show(self) -> None:
        """Show the picture in a window or a notebook. Raises RuntimeError if there is neither."""
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
        return self._written("png", dpi)

    def _written(self, kind: str, dpi: float | None) -> bytes:
        """Return the contents of a file; the same picture gives the same bytes."""
        from matplotlib import rc_context

        dpi = self.figure.dpi if dpi is None else positive("dpi", "", dpi)
        check_pixels(*(dpi * self.figure.get_size_inches()), "ask for fewer dots an inch (`dpi`)")
        buffer = io.BytesIO()
        undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
        with rc_context({"svg.hashsalt": "magshell", "pdf.fonttype": 42}):
            self.figure.savefig(buffer, format=kind, dpi=dpi, metadata=undated)
        return buffer.getvalue()

    def __repr__(self) -> str:
        width, height = self.figure.canvas.get_width_height()
        return f"Picture({width} x {height} pixels, painted by {self.backend})"


def paint(drawing: Drawing, width: int, columns: int | None, backend: str, dpi: int = DPI) -> Picture:
    """Paint a drawing, `width` pixels wide, with its panels in `columns` columns (None for the best number)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(drawing.panels)
    columns = columns or _best_columns(count, drawing.window)
    rows = -(-count // columns)
    inches, ruler = width / dpi, Ruler(dpi)
    panel_width = (inches - 2 * MARGIN) / columns
    window = _with_room(drawing, panel_width, ruler)
    panel_height = panel_width * (window[3] - window[2]) / (window[1] - window[0])
    scale = panel_width / (window[1] - window[0])
    strip = legend.arranged(drawing, inches, scale, ruler)
    title = _title_height(drawing, panel_width, ruler)
    height = rows * (panel_height + title) + strip.height + 2 * MARGIN
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
            paint_panel(axes, panel, drawing, window, screen, title, ruler)
    axes = figure.add_axes((0.0, 0.0, 1.0, strip.height / height))
    legend.write(axes, drawing, strip, inches, scale, ruler)
    return Picture(figure, backend)


@contextmanager
def screen_of(axes: Axes, backend: str, samples: bool = True) -> Iterator[Screen]:
    """Open what a panel is painted on before it is copied to the axes. samples: whether edges are smooth as in pictures."""
    box = axes.get_window_extent()
    pixels = round(box.width), round(box.height)
    if backend == "pyvista":
        screen = vtk.Screen(pixels, samples)
    else:
        finely = raster.SAMPLES if samples else raster.MOVIE_SAMPLES
        screen = raster.Screen(pixels, finely) if backend == "magshell" else polygons.Screen()
    try:
        yield screen
    finally:
        screen.close()


def paint_panel(
    axes: Axes,
    panel: Panel,
    drawing: Drawing,
    window: Any,
    screen: Screen,
    title: float,
    ruler: Ruler,
) -> None:
    """Paint a panel into its axes.

    window: (left, right, bottom, top) m. title: inches for the title above the axes.
    """
    axes.set_axis_off()
    axes.set_xlim(window[0], window[1])
    axes.set_ylim(window[2], window[3])
    screen.paint(axes, panel, drawing.view, window)
    if drawing.ticks:
        write_ticks(axes, drawing, window)
    box = axes.get_window_extent()
    size = np.array([box.width, box.height]) / axes.figure.dpi
    if panel.title:
        text, points = ruler.fitted(panel.title, TEXT + 1, size[0] - MARGIN, title - TITLE_GAP)
        axes.set_title(text, fontsize=points, color=colors.OUTLINE, pad=72 * TITLE_GAP)
    room = Room(
        Box(np.zeros(2), size), _drawn(panel, drawing, window, size) if panel.labels else np.zeros((0, 2))
    )
    for label in panel.labels:
        _write(axes, label, drawing, window, room, ruler)


def _drawn(panel: Panel, drawing: Drawing, window, size: np.ndarray) -> np.ndarray:
    """Return points (n, 2), inches in the panel, distributed over its bodies and arrows."""
    bodies = [each for each in panel.solids if len(each.faces) and not each.around]
    corners = [drawing.view.project(each.positions)[each.faces][:, :, :2] for each in bodies]
    if not corners:
        return np.zeros((0, 2))
    corners = (np.concatenate(corners) - window[::2]) / (window[1] - window[0]) * size[0]
    longest = np.ptp(corners, axis=1).max()
    count = int(np.clip(np.ceil(longest / SPREAD), 1, MOST_SPREAD))
    indices = [(i, j, count - i - j) for i in range(count + 1) for j in range(count + 1 - i)]
    weights = np.array(indices) / count  # barycentric coordinates
    return np.einsum("ks,fsi->fki", weights, corners).reshape(-1, 2)


def title_height(axes: Axes) -> float:
    """Return the height for a title above axes at the top of a figure, inches."""
    figure = axes.figure
    return figure.get_size_inches()[1] - axes.get_window_extent().y1 / figure.dpi - MARGIN


def _title_height(drawing: Drawing, panel_width: float, ruler: Ruler) -> float:
    """Return the height above each panel, inches, for the title with the most lines."""
    texts = [panel.title for panel in drawing.panels if panel.title]
    if not texts:
        return 0.0
    lines = [ruler.broken(text, TEXT + 1, panel_width - MARGIN).count("\n") + 1 for text in texts]
    return TITLE_GAP + min(max(lines), TITLE_LINES) * (TITLE - TITLE_GAP)


def _write(axes, label: Label, drawing: Drawing, window, room: Room, ruler: Ruler) -> None:
    """Write a label next to its point, or where there is room, then with a line to the point."""
    from matplotlib.patheffects import withStroke

    area = room.area.high
    point = (drawing.view.project(label.point)[:2] - window[::2]) / (window[1] - window[0]) * area[0]
    if drawing.view.frame and ((point < 0) | (point > area)).any():
        return  # its point is not in the window
    text, points = ruler.fitted(label.text, TEXT, area[0], area[1])
    size = ruler.size(text, points)
    found = room.take(size, candidate_centers(point, size, label.towards))
    if found is None:
        return
    corner, nearest = found.low - point, np.clip(point, found.low, found.high) - point
    if np.linalg.norm(nearest) > 2 * NEAR:
        ends = np.array([point, point + nearest]) / area
        axes.plot(*ends.T, color=label.color, linewidth=0.5, alpha=0.6, transform=axes.transAxes)
    axes.annotate(
        text,
        tuple(point / area),
        xycoords="axes fraction",
        xytext=tuple(72 * corner),
        textcoords="offset points",
        ha="left",
        va="bottom",
        fontsize=points,
        color=label.color,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _with_room(drawing: Drawing, inches: float, ruler: Ruler) -> np.ndarray:
    """Return the window of a panel of a given width [inches], with room for its labels, neither too flat nor too tall."""
    left, right, bottom, top = drawing.window
    for _ in range(
        2
    ):  # the first pass finds the scale between the inches of texts and the metres of the window
        scale = (right - left) / inches
        for panel in [] if drawing.view.frame else drawing.panels:
            for label in panel.labels:
                point = drawing.view.project(label.point)[:2] / scale
                size = np.minimum(ruler.size(label.text, TEXT), 0.6 * inches)
                middle = text_center(point, size, np.array(label.towards))
                (x0, y0), (x1, y1) = scale * (middle - 0.55 * size), scale * (middle + 0.55 * size)
                left, right, bottom, top = min(left, x0), max(right, x1), min(bottom, y0), max(top, y1)
    width, height = right - left, top - bottom
    extra = max(FLATTEST * width - height, 0.0) / 2
    bottom, top = bottom - extra, top + extra
    extra = max((top - bottom) / TALLEST - width, 0.0) / 2
    return np.array([left - extra, right + extra, bottom, top])


def _best_columns(count: int, window: np.ndarray) -> int:
    """Return the number of columns that makes a picture about twice as wide as high, with few empty panels."""
    shape = (window[1] - window[0]) / (window[3] - window[2])
    shape = min(shape, 1.0 / FLATTEST)

    def cost(columns: int) -> float:
        rows = -(-count // columns)
        return abs(np.log(columns * shape / rows / 2.0)) + 2.0 * (rows * columns / count - 1.0)

    return min(range(1, count + 1), key=cost)
