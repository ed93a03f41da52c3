"""Figure of the microseconds per face, by sheet and size."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from ..kernels import ALLOWED
from .style import BLUE, FAINT, INK, SKY, label_bars, machine, new_figure, note, panel_title, tidy


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    sheets = results["sheets"]
    sizes = [cost["faces"] for cost in next(iter(sheets.values()))]
    figure = new_figure(4.2 * len(sizes) + 2.2, 1.5 + 0.42 * len(sheets))
    grid = figure.subplots(1, len(sizes), sharex=True, sharey=True, squeeze=False)[0]
    positions = range(len(sheets))
    for k, (axes, faces) in enumerate(zip(grid, sizes, strict=True)):
        costs = [of_sheet[k] for of_sheet in sheets.values()]
        both = [1e6 * cost["hessian"][0] / cost["faces"] for cost in costs]
        gradient = [1e6 * cost["gradient"][0] / cost["faces"] for cost in costs]
        axes.barh(positions, both, color=SKY, height=0.66, label="gradient and Hessian")
        axes.barh(positions, gradient, color=BLUE, height=0.3, label="gradient")
        label_bars(axes, positions, both, ".2f")
        axes.axvline(ALLOWED, color=FAINT, linestyle="--", linewidth=1.0)
        axes.margins(x=0.12)
        tidy(axes, grid="x")
        axes.tick_params(axis="y", length=0)
        panel_title(axes, f"{faces:,} faces", "µs a face")
    grid[0].set_yticks(positions, list(sheets))
    grid[0].invert_yaxis()
    figure.legend(
        *grid[0].get_legend_handles_labels(),
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        loc="outside upper right",
    )
    note(figure, f"dashed: what the first line may take; {machine(setting)}")
    return figure
