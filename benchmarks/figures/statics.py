"""Figure of the factorizations from flat by each method, and of the time of each backend's factorization."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from ..statics import BENDINGS, CASES, SOLVERS
from .style import (
    BENDING_COLOURS,
    COLOURS,
    FAINT,
    INK,
    label_bars,
    machine,
    new_figure,
    note,
    panel_title,
    tidy,
)

STEPS = ("analysis", "factorization", "solve")


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    figure = new_figure(11.0, 4.2)
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    _from_flat(left, results["from flat"])
    _backends(right, results["backends"])
    for axes in (left, right):
        axes.tick_params(axis="y", length=0, labelsize=8.5)
        position = "lower right" if axes is left else "upper right"
        axes.legend(frameon=False, fontsize=8, labelcolor=INK, loc=position)
    iteration = results["iteration"]
    note(
        figure,
        f"strongly bent, {results['faces']} faces: {iteration['factorizations']} factorizations, {iteration['worth']:.1f} "
        f"factorizations' worth of time; {machine(setting)}",
    )
    return figure


def _from_flat(axes, found: dict[str, Any]) -> None:
    methods = [(bending, solver) for bending in BENDINGS for solver in SOLVERS]
    width = 0.8 / len(methods)
    for k, (bending, solver) in enumerate(methods):
        look = {"color": BENDING_COLOURS[bending], "alpha": 1.0 if solver == "mixed" else 0.4}
        for row, case in enumerate(CASES):
            run = found[f"{case}, {bending}, {solver}"]
            position = row + (k - (len(methods) - 1) / 2) * width
            count = run["factorizations"]
            label = f"{bending}, {solver} Newton" if row == 0 else None
            axes.barh(position, count, height=width, label=label, **look)
            text = f"{count}, failed" if run["failed"] else str(count)
            axes.annotate(
                text,
                (count, position),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
                color=INK,
            )
    for row, (_, _, allowed) in enumerate(CASES.values()):
        axes.plot([allowed, allowed], [row - 0.4, row + 0.4], color=FAINT, linestyle="--", linewidth=1.2)
    axes.set_yticks(range(len(CASES)), list(CASES))
    axes.invert_yaxis()
    axes.margins(x=0.1)
    tidy(axes, grid="x")
    panel_title(axes, "Factorizations from flat in one call", "dashed: what midedge, mixed may take")


def _backends(axes, backends: dict[str, Any]) -> None:
    width = 0.8 / len(STEPS)
    for k, (step, colour) in enumerate(zip(STEPS, COLOURS, strict=False)):
        positions = [row + (k - 1) * width for row in range(len(backends))]
        values = [1e3 * times[step] for times in backends.values()]
        axes.barh(positions, values, height=width, color=colour, label=step)
        label_bars(axes, positions, values, ".3g")
    axes.set_yticks(range(len(backends)), list(backends))
    axes.invert_yaxis()
    axes.margins(x=0.12)
    tidy(axes, grid="x")
    panel_title(axes, "Linear algebra of its Hessian, by backend", "ms")
