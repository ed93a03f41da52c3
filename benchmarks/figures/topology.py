"""Figure of topologies: the cost of an iteration, the objective over meshes, and void in large rotations."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from .style import BLUE, GREEN, VERMILION, label_bars, machine, new_figure, note, panel_title, tidy


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    figure = new_figure(11.0, 3.2)
    left, middle, right = figure.subplots(1, 3)
    iteration = results.get("iteration", {})
    _bars(left, {name: row["iteration"] for name, row in iteration.items()}, BLUE, ".3g")
    panel_title(left, "Iteration", "processor time, s")
    meshes = {name: value for name, value in results.get("meshes", {}).items() if name != "spread"}
    _bars(middle, meshes, GREEN, ".4g")
    panel_title(middle, "Stiffest sheet", "objective, by faces")
    void = results.get("void", {})
    _bars(right, {name: row["factorizations"] for name, row in void.items()}, VERMILION, ".3g")
    panel_title(right, "Large rotations", "factorizations, by void")
    note(figure, machine(setting))
    return figure


def _bars(axes: Any, values: dict[str, float], color: str, digits: str) -> None:
    positions = range(len(values))
    axes.barh(positions, list(values.values()), color=color, height=0.66)
    label_bars(axes, positions, list(values.values()), digits)
    axes.set_xlim(0.0, 1.25 * max(values.values(), default=1.0))
    axes.set_yticks(positions, list(values))
    axes.invert_yaxis()
    tidy(axes, grid="x")
