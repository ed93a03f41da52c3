"""What all figures of the bench share: colours, axes without clutter."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# By Okabe and Ito, which most eyes tell apart.
BLUE, SKY, VERMILION, ORANGE, GREEN, PURPLE = "#0072B2", "#56B4E9", "#D55E00", "#E69F00", "#009E73", "#AA4499"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE)
INK, FAINT, SHADE = "#333333", "#8A8A8A", "#EDEDED"
BENDING_COLOURS = {"midedge": BLUE, "midedge2": GREEN, "hinge": VERMILION}


def new_figure(width: float, height: float) -> Figure:
    """Inches."""
    return Figure(figsize=(width, height), layout="constrained", facecolor="white")


def tidy(axes: Axes, *, grid: str | None = "both") -> None:
    """Two spines, small ticks, a grid that keeps back."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(labelsize=8, color=FAINT, labelcolor=INK, which="both")
    if grid:
        axes.grid(True, which="major", axis=grid, color=SHADE, linewidth=0.8)
    axes.set_axisbelow(True)


def panel_title(axes: Axes, text: str, below: str = "") -> None:
    """Bold, to the left; what explains it below, small."""
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
    """Of the whole figure, small, under it."""
    figure.supxlabel(text, fontsize=8, color=FAINT, x=0.01, ha="left")


def machine(setting: dict[str, Any]) -> str:
    """On what the numbers were made, in a line."""
    threads = setting["threads"]
    return f"{setting['processor']}, {threads} thread{'s' if threads != 1 else ''}, magshell {setting['magshell']}"


def label_bars(axes: Axes, places: Iterable[float], values: Iterable[float], form: str) -> None:
    """Writes each value at the end of its horizontal bar."""
    for place, value in zip(places, values, strict=True):
        axes.annotate(
            format(value, form),
            (value, place),
            (4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color=INK,
        )
