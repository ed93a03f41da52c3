"""Figure of the cost that each part of a scene adds: three columns of bars."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from .style import BLUE, FAINT, GREEN, VERMILION, label_bars, machine, new_figure, note, panel_title, tidy

PANELS = {
    "assembly": ("Gradient and Hessian", BLUE),
    "iteration": ("Newton iteration", GREEN),
    "step_iteration": ("Newton iteration of a time step", VERMILION),
}


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    parts = results["parts"]
    figure = new_figure(11.0, 1.5 + 0.34 * len(parts))
    positions = range(len(parts))
    for axes, (name, (title, colour)) in zip(figure.subplots(1, 3, sharey=True), PANELS.items(), strict=True):
        values = [1e3 * part[name] for part in parts]
        before = [0.0, *values[:-1]]
        same = [min(a, b) for a, b in zip(values, before, strict=True)]
        axes.barh(positions, same, color=colour, alpha=0.3, height=0.66)
        more = [max(0.0, a - b) for a, b in zip(values, before, strict=True)]
        axes.barh(positions, more, left=same, color=colour, height=0.66)
        label_bars(axes, positions, values, ".3g")
        axes.set_xlim(0.0, 1.16 * max(values))
        tidy(axes, grid="x")
        panel_title(axes, title, "ms; dark: more than the line above")
        axes.tick_params(axis="y", length=0)
    axes.set_yticks(
        positions, [part["part"] if k == 0 else f"+ {part['part']}" for k, part in enumerate(parts)]
    )
    axes.invert_yaxis()
    axes.axvline(0.0, color=FAINT, linewidth=0.8)
    note(figure, f"{results['faces']} faces, steps of implicit Euler; {machine(setting)}")
    return figure
