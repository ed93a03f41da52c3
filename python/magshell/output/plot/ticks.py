"""Ticks with coordinates along the edges of a panel that is seen along an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import colors
from .view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .panels import Drawing

_TEXT = 6.5  # points
_MOST = 7  # intervals between the ticks along an edge
_LENGTH, _GAP = 4.0, 3.0  # [points] length of a tick, and distance of its number from it
_ALONG = 1.0 - 1e-9  # [-] cosine from which a direction is that of an axis


def check_ticks(view: View) -> None:
    """Raise ValueError if the edges of a view's window are not parallel to two coordinate axes."""
    if min(np.abs(view.axes[0]).max(), np.abs(view.axes[1]).max()) < _ALONG:
        raise ValueError('ticks need a view along an axis: view="front", "side" or "top"')


def write_ticks(axes: Axes, drawing: Drawing, window: Any) -> None:
    """Write ticks along the lower and the left edge of a panel, inside of it, in the unit of the scale bar.

    The largest number of an edge has the unit. window: (left, right, bottom, top) m; where the view looks along an axis from
    behind, coordinates decrease to the right or upwards.
    """
    from matplotlib.patheffects import withStroke
    from matplotlib.ticker import MaxNLocator

    unit, halo = drawing.unit.meters, [withStroke(linewidth=2.0, foreground="white")]
    for number, ends in enumerate((window[:2], window[2:])):
        axis = int(np.argmax(np.abs(drawing.view.axes[number])))
        sign = float(np.sign(drawing.view.axes[number][axis]))
        low, high = sorted((sign * ends[0] / unit, sign * ends[1] / unit))
        values = MaxNLocator(_MOST, steps=[1, 2, 5, 10]).tick_values(low, high)
        margin = 0.04 * (high - low)
        shown = values[(values > low + margin) & (values < high - margin)]
        for value in shown:
            text = f"{round(float(value), 9):g}" + (f" {drawing.unit.name}" if value == shown[-1] else "")
            place = (sign * value * unit, 0.0) if number == 0 else (0.0, sign * value * unit)
            aside = (0.0, _LENGTH + _GAP) if number == 0 else (_LENGTH + _GAP, 0.0)
            across = (0.0, _LENGTH) if number == 0 else (_LENGTH, 0.0)
            coordinates = ("data", "axes fraction") if number == 0 else ("axes fraction", "data")
            axes.annotate(
                "",
                place,
                xycoords=coordinates,
                xytext=across,
                textcoords="offset points",
                arrowprops={
                    "arrowstyle": "-",
                    "linewidth": 0.7,
                    "color": colors.OUTLINE,
                    "shrinkA": 0,
                    "shrinkB": 0,
                },
            )
            axes.annotate(
                text,
                place,
                xycoords=coordinates,
                xytext=aside,
                textcoords="offset points",
                ha="center" if number == 0 else "left",
                va="bottom" if number == 0 else "center",
                fontsize=_TEXT,
                color=colors.OUTLINE,
                path_effects=halo,
            )
        edge = [(0.0, 1.0), (0.0, 0.0)] if number == 0 else [(0.0, 0.0), (0.0, 1.0)]
        axes.plot(*edge, color=colors.OUTLINE, linewidth=0.8, transform=axes.transAxes)
