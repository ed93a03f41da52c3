"""Shared style of all figures: colours, axes without clutter."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The colours of Okabe and Ito, which colour-blind readers can distinguish.
BLUE, SKY, VERMILION, ORANGE, GREEN, PURPLE = "#0072B2", "#56B4E9", "#D55E00", "#E69F00", "#009E73", "#AA4499"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE)
INK, FAINT, SHADE = "#333333", "#8A8A8A", "#EDEDED"
BENDING_COLOURS = {"midedge": BLUE, "midedge2": GREEN, "hinge": VERMILION}


def new_figure(width: float, height: float) -> Figure:
    """Return a new figure of this size in inches."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def tidy(axes: Axes, *, grid: str | None = "both") -> None:
    """Draw the axes with two spines, small ticks and a faint grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=INK, which="both")
    if grid:
        axes.grid(True, which="major", axis=grid, color=SHADE, linewidth=0.8)
    axes.set_axisbelow(True)


def panel_title(axes: Axes, text: str, below: str = "") -> None:
    """Write a bold title at the left, with a small explanation below."""
    axes.set_title(text, loc="left", fontsize=9.5, fontweight="bold", color=INK, pad=16 if below else 6)
    if below:
        axes.annotate(
            below,
            (0, 1),
            (0, 4),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=7.5,
            color=FAINT,
        )


def note(figure: Figure, text: str) -> None:
    """Write a small note under the whole figure."""
    figure.supxlabel(text, fontsize=8, color=FAINT, x=0.01, ha="left")


def machine(setting: dict[str, Any]) -> str:
    """Describe in one line the machine and version that produced the numbers."""
    threads = setting["threads"]
    return f"{setting['processor']}, {threads} thread{'s' if threads != 1 else ''}, magshell {setting['magshell']}"


def label_bars(axes: Axes, positions: Iterable[float], values: Iterable[float], form: str) -> None:
    """Write each value at the end of its horizontal bar; positions: the bars' coordinates along y."""
    for position, value in zip(positions, values, strict=True):
        axes.annotate(
            format(value, form),
            (value, position),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color=INK,
        )
