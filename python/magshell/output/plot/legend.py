"""The legend under the panels: coordinate axes, scale bar, keys of arrows and colour bar, in one row if there is room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..results.units import round_below
from . import colors
from .colors import Scalar, scale_colors
from .label_layout import Box, Room
from .panels import Drawing
from .texts import Ruler

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TEXT = 8.0  # points
ROW = 0.72  # [inch] height of a row
SMALLER = (1.0, 0.9, 0.8)  # [-] scales at which the legend is tried in one row
EDGE = 0.05  # [inch] margin at the picture's sides
SPACE = 0.35  # [inch] gap between the parts
TRIAD = np.array([0.36, 0.32])  # [inch] origin of the coordinate axes
SCALE_BAR = 0.85  # [inch] left end of the scale bar
# [inch] width of an arrow with the gap before its text; distance between rows of keys
KEY, KEY_ROW = (0.38, 0.2)
# [inch] widths of a colour bar; how far tick labels may reach beyond it
NARROWEST, WIDEST, OVERHANG = (0.8, 2.4, 0.25)
APART = 0.08  # [inch] distance between the names of values
LINE = 0.15  # [inch] height of an additional line of the colour bar's text


@dataclass(frozen=True)
class Legend:
    """The layout of a legend, in inches at full size; it is painted `scale` times as large.

    rows: their heights, from the first on. length: of the scale bar, m. keys, bar: (row, left end) of the keys of arrows and
    of the colour bar, or None. key_size: the text size of keys, points. width: of the colour bar. label: the colour bar's
    text, broken into lines, and its size in points.
    """

    scale: float
    rows: tuple[float, ...]
    length: float
    keys: tuple[int, float] | None
    key_size: float
    bar: tuple[int, float] | None
    width: float
    label: tuple[str, float]

    @property
    def height(self) -> float:
        """The height of the painted legend, inches."""
        return self.scale * sum(self.rows)

    def bottom(self, row: int) -> float:
        """Return the height of a row's lower edge above that of the last row."""
        return sum(self.rows[row + 1 :])


def arranged(drawing: Drawing, inches: float, inches_per_meter: float, ruler: Ruler) -> Legend:
    """Compute the layout of the legend in a picture of a given width [inches].

    It is one row at full size if that fits, or at a slightly smaller scale, and several rows otherwise.
    """
    tried = [_arranged(drawing, inches / scale, inches_per_meter / scale, scale, ruler) for scale in SMALLER]
    flat = [each for each in tried if len(each.rows) == 1]
    return flat[0] if flat else tried[1]


def _arranged(drawing: Drawing, inches: float, inches_per_meter: float, scale: float, ruler: Ruler) -> Legend:
    """Compute the layout of the legend at one scale, with a new row for each part that does not fit."""
    length = round_below(min(1.2, 0.2 * inches) / inches_per_meter)
    rows, end = [ROW], _scale_bar_end(drawing, length, inches_per_meter, ruler)
    keys, key_size = None, TEXT
    if drawing.arrows:
        wide = KEY + max(ruler.size(text, TEXT)[0] for text, _ in drawing.arrows)
        if end + SPACE + wide > inches - EDGE:
            rows.append(KEY_ROW * (len(drawing.arrows) + 0.6))
            end = EDGE - SPACE
            key_size *= min(1.0, (inches - 2 * EDGE - KEY) / (wide - KEY))
        keys = len(rows) - 1, end + SPACE
        end += SPACE + wide
    bar, width, label = None, 0.0, ("", TEXT)
    if (scalar := drawing.scalar) is not None:
        asked = min(ruler.size(scalar.label, TEXT)[0], 0.45 * inches)
        named = sum(ruler.size(text, TEXT - 1)[0] + APART for _, text in scalar.names)
        needed = max(NARROWEST + 2 * OVERHANG, asked, named)
        if end + SPACE + needed > inches - EDGE:
            rows.append(ROW)
            end = EDGE - SPACE
        room = inches - EDGE - end - SPACE
        width = max(min(WIDEST, 0.32 * inches, room - 2 * OVERHANG), min(NARROWEST, room - 2 * OVERHANG))
        width = max(width, min(named, room - 2 * OVERHANG))
        bar = len(rows) - 1, end + SPACE
        label = ruler.fitted(scalar.label, TEXT, room, 4 * LINE)
        rows[-1] = max(rows[-1], ROW) + label[0].count("\n") * LINE
    return Legend(scale, tuple(rows), length, keys, key_size, bar, width, label)


def _scale_bar_end(drawing: Drawing, length: float, inches_per_meter: float, ruler: Ruler) -> float:
    return SCALE_BAR + max(length * inches_per_meter, ruler.size(_length(drawing, length), TEXT)[0], 0.5)


def _length(drawing: Drawing, length: float) -> str:
    return f"{round(length / drawing.unit.meters, 9):g} {drawing.unit.name}"


def write(
    axes: Axes, drawing: Drawing, legend: Legend, inches: float, inches_per_meter: float, ruler: Ruler
) -> None:
    """Draw a legend into axes that are as wide as the picture and as high as the legend."""
    scale = legend.scale
    writer = _Writer(axes, inches / scale, legend.height / scale, scale, ruler)
    first = legend.bottom(0)
    _triad(writer, drawing, TRIAD + np.array([0.0, first]))
    text, long = _length(drawing, legend.length), legend.length * inches_per_meter / scale
    middle = SCALE_BAR + 0.5 * max(long, ruler.size(text, TEXT)[0])
    writer.line([middle - 0.5 * long, middle + 0.5 * long], [first + 0.36] * 2, 2.0)
    writer.text((middle, first + 0.28), text, TEXT, "center", "top")
    if legend.keys is not None:
        row, left = legend.keys
        height = ROW if row == 0 or (legend.bar and legend.bar[0] == row) else legend.rows[row]
        middle = legend.bottom(row) + 0.5 * height + 0.5 * KEY_ROW * (len(drawing.arrows) - 1)
        for k, (text, color) in enumerate(drawing.arrows):
            y = middle - KEY_ROW * k
            writer.arrow((left, y), (left + 0.3, y), color, 1.4)
            writer.text((left + KEY, y), text, legend.key_size, "left", "center")
    if legend.bar is not None and drawing.scalar is not None:
        _color_bar(writer, drawing.scalar, legend)


class _Writer:
    """Drawing commands in inches at full size, for axes that may be smaller."""

    def __init__(self, axes, width: float, height: float, scale: float, ruler: Ruler):
        self.axes, self.width, self.height, self.scale, self.ruler = axes, width, height, scale, ruler
        axes.set_axis_off()
        self.set_limits()

    def set_limits(self) -> None:
        self.axes.set_xlim(0.0, self.width)
        self.axes.set_ylim(0.0, self.height)

    def line(self, x, y, width: float) -> None:
        self.axes.plot(x, y, color=colors.OUTLINE, linewidth=width, solid_capstyle="butt")

    def text(self, position, text: str, size: float, across: str, up: str) -> None:
        size *= self.scale
        style = {"fontsize": size, "color": colors.OUTLINE, "linespacing": 1.1}
        self.axes.text(*position, text, ha=across, va=up, **style)

    def arrow(self, start, end, color: str, width: float, **style) -> None:
        style = {"arrowstyle": "-|>", "color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0, **style}
        self.axes.annotate("", end, start, arrowprops=style)


def _triad(writer: _Writer, drawing: Drawing, origin: np.ndarray) -> None:
    """Draw the coordinate axes; the letters of axes that coincide on the screen are placed next to each other."""
    room = Room(Box(np.zeros(2), np.array([SCALE_BAR, writer.height])))
    size = TEXT - 1
    for name, tip in zip("xyz", 0.24 * drawing.view.axes[:2].T, strict=True):
        if np.linalg.norm(tip) < 0.03:  # the axis points towards the eye
            continue
        writer.arrow(origin, origin + tip, colors.OUTLINE, 0.9, mutation_scale=6)
        along = tip / np.linalg.norm(tip)
        aside = np.array([-along[1], along[0]])
        box = writer.ruler.size(name, size)
        centers = (
            origin + tip + out * along + off * aside
            for out in (0.07, 0.0, -0.1)
            for off in (0.0, 0.14, -0.14, 0.28, -0.28)
        )
        found = room.take(box, centers)
        if found is not None:
            writer.text(0.5 * (found.low + found.high), name, size, "center", "center")


def _color_bar(writer: _Writer, scalar: Scalar, legend: Legend) -> None:
    """Draw the colour bar at the right end of its row."""
    low, high = scalar.limits
    right = writer.width - EDGE - OVERHANG
    left = right - legend.width
    shades = scale_colors(scalar.scale, np.linspace(low, high, 256), (low, high))
    extent = (left, right, 0.30, 0.42)
    writer.axes.imshow(shades[None], extent=extent, aspect="auto", interpolation="bilinear")
    writer.set_limits()
    ticks = ticks_of(scalar, legend.width, writer.ruler)
    at = np.array([left + (tick - low) / (high - low) * legend.width for tick, _ in ticks])
    widths = np.array([writer.ruler.size(text, TEXT - 1)[0] for _, text in ticks])
    room = legend.width + 2 * OVERHANG
    shrunk = min(1.0, room / (widths.sum() + APART * len(ticks))) if scalar.names else 1.0
    places = (
        side_by_side(at, shrunk * (widths + APART), left - OVERHANG, right + OVERHANG) if scalar.names else at
    )
    for x, place, (_, text) in zip(at, places, ticks, strict=True):
        writer.line([x, x], [0.27, 0.30], 0.7)
        writer.text((place, 0.25), text, shrunk * (TEXT - 1), "center", "top")
    text, points = legend.label
    half = 0.5 * writer.ruler.size(text, points)[0]
    middle = min((left + right) / 2, writer.width - EDGE - half)  # the text may be longer than the bar
    writer.text((middle, 0.47), text, points, "center", "bottom")


def ticks_of(scalar: Scalar, width: float, ruler: Ruler) -> list[tuple[float, str]]:
    """Choose the ticks of a colour bar of a given width [inches]: (number, text) each.

    There are as many as do not overlap, and at least one; or the names of values, if there are any.
    """
    from matplotlib.ticker import MaxNLocator

    low, high = scalar.limits
    if scalar.names:
        return [(value, text) for value, text in scalar.names if low <= value <= high]
    tried = [MaxNLocator(count).tick_values(low, high) for count in (4, 3, 2)]
    if scalar.scale == "cyclic" and (low, high) == (0.0, 360.0):
        tried = [np.array([0, 90, 180, 270, 360.0]), np.array([0, 180, 360.0])]
    for ticks in [*tried, np.array([low, high])]:
        inside = ticks[(ticks >= low - 1e-9 * (high - low)) & (ticks <= high + 1e-9 * (high - low))]
        if len(inside) < 2:
            continue
        texts = _written(inside, high - low)
        middles = (inside - low) / (high - low) * width
        halves = np.array([0.5 * ruler.size(text, TEXT - 1)[0] for text in texts])
        apart = np.diff(middles) - halves[1:] - halves[:-1]
        held = (middles - halves).min() > -OVERHANG and (middles + halves).max() < width + OVERHANG
        if apart.min() > 0.06 and held:
            return list(zip(inside.tolist(), texts, strict=True))
    middle = 0.5 * (low + high)
    return [(middle, _written(np.array([middle]), high - low)[0])]


def side_by_side(centers: np.ndarray, widths: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return the places of texts next to each other, moved as little as needed between two limits.

    centers: ascending. The sum of the widths must be at most the distance of the limits.
    """
    places = np.array(centers, dtype=float)
    least = low
    for k, width in enumerate(widths):
        places[k] = max(places[k], least + 0.5 * width)
        least = places[k] + 0.5 * width
    most = high
    for k in range(len(places) - 1, -1, -1):
        places[k] = min(places[k], most - 0.5 * widths[k])
        most = places[k] - 0.5 * widths[k]
    return places


def _written(ticks: np.ndarray, extent: float) -> list[str]:
    """Format numbers with as many digits as are needed to distinguish them."""
    ticks = np.where(np.abs(ticks) < 1e-9 * extent, 0.0, ticks)
    for digits in range(6, 17):
        texts = [f"{float(f'{tick:.12g}'):.{digits}g}" for tick in ticks.tolist()]
        if np.abs(np.array(texts, dtype=float) - ticks).max() <= 1e-3 * extent:
            break
    return texts
