"""Figure of error against time, with a small panel for each case."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter

from ..work_precision import STUDIES, Study
from .style import BENDING_COLOURS, INK, SHADE, machine, new_figure, panel_title, tidy

COLUMNS = 5
_SMALLEST, _LARGEST = 2e-5, 1.5  # errors that the panels show


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    points = results["error against time"]
    others = results.get("beside NGSolve", {}).get("points", [])
    studies = [study for study in STUDIES if any(point["case"] == study.name for point in points)]
    columns = min(COLUMNS, len(studies))
    rows = -(-len(studies) // columns)
    figure = new_figure(2.5 * columns + 0.4, 2.35 * rows + 0.7)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, study in zip(grid.flat, studies, strict=False):
        _panel(axes, study, [point for point in points if point["case"] == study.name])
        _others(axes, [point for point in others if point["case"] == study.name])
    _legend(figure, bool(others))
    for axes in list(grid.flat)[len(studies) :]:
        axes.axis("off")
    for k, axes in enumerate(list(grid.flat)[: len(studies)]):
        below = k + columns
        axes.tick_params(labelleft=k % columns == 0, labelbottom=below >= len(studies))
    figure.supylabel("largest relative error", fontsize=10, color=INK)
    figure.supxlabel(
        f"time of one call from the rest shape, analysis included ({machine(setting)})",
        fontsize=10,
        color=INK,
    )
    return figure


def _panel(axes, study: Study, points: list[dict[str, Any]]) -> None:
    axes.set(xscale="log", yscale="log", ylim=(_SMALLEST, _LARGEST))
    axes.xaxis.set_major_locator(LogLocator(numticks=8))
    axes.xaxis.set_major_formatter(_time)
    axes.yaxis.set_major_formatter(_percent)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    if study.known_to > _SMALLEST:
        axes.axhspan(_SMALLEST, study.known_to, color=SHADE, zorder=0)
    for (bending, colour), irregular in (
        (each, i) for each in BENDING_COLOURS.items() for i in (False, True)
    ):
        of_kind = [
            p
            for p in points
            if (p["bending"], p["irregular"]) == (bending, irregular) and p["error"] is not None
        ]
        _curve(axes, [p for p in of_kind if p["solver"] != "plain"], colour, irregular, plain=False)
        _curve(axes, [p for p in of_kind if p["solver"] == "plain"], colour, irregular, plain=True)
    tidy(axes)
    panel_title(axes, f"{study.name}  {study.title}", study.reference)


def _others(axes, points: list[dict[str, Any]]) -> None:
    """Draw NGSolve's points on regular meshes, each as the number of its order."""
    for point in points:
        if not point["irregular"]:
            axes.plot(point["time"], max(point["error"], _SMALLEST), **_number(point["order"]))


def _number(order) -> dict[str, Any]:
    return {
        "color": INK,
        "linestyle": "none",
        "marker": f"${order}$",
        "markersize": 4.5,
        "markeredgewidth": 0.4,
        "clip_on": False,
        "zorder": 4,
    }


def _curve(axes, points: list[dict[str, Any]], colour: str, irregular: bool, plain: bool) -> None:
    if not points:
        return
    times = np.array([point["time"] for point in points])
    errors = np.maximum([point["error"] for point in points], _SMALLEST)
    axes.plot(times, errors, **_line_style(colour, irregular, plain))


def _line_style(colour: str, irregular: bool, plain: bool) -> dict[str, Any]:
    """Return the style of a curve: filled for the mixed method or linear theory, hollow for plain Newton; dashed if
    irregular."""
    return {
        "color": colour,
        "linestyle": (0, (3, 1.5)) if irregular else "-",
        "linewidth": 0.8 if plain else 1.6,
        "alpha": 0.55 if plain else 1.0,
        "marker": "^" if irregular else "o",
        "markersize": 3.6,
        "markerfacecolor": "white" if plain else colour,
        "markeredgewidth": 0.8,
        "clip_on": False,
        "zorder": 2 if plain else 3,
    }


def _legend(figure: Figure, others: bool) -> None:
    lines = [
        (
            f"{bending}, {'irregular' if irregular else 'regular'} mesh",
            _line_style(colour, irregular, plain=False),
        )
        for bending, colour in BENDING_COLOURS.items()
        for irregular in (False, True)
    ]
    lines.append(("the same by plain Newton", _line_style(INK, irregular=False, plain=True)))
    handles = [Line2D([], [], label=label, **style) for label, style in lines]
    if others:
        handles.append(Line2D([], [], label="NGSolve, of the order written, regular mesh", **_number(2)))
    handles.append(Patch(color=SHADE, label="below the reference's accuracy"))
    figure.legend(
        handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=8.5, labelcolor=INK
    )


def _time(seconds: float, _) -> str:
    return (
        f"{1e6 * seconds:.0f} µs"
        if seconds < 1e-3
        else f"{1e3 * seconds:g} ms"
        if seconds < 1
        else f"{seconds:g} s"
    )


def _percent(error: float, _) -> str:
    return f"{100 * error:g} %"
