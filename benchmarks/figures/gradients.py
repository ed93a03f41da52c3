"""Figure of the time of a gradient beside that of its equilibrium."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from ..gradients import ALLOWED_SHARE
from .style import BLUE, INK, SKY, VERMILION, machine, new_figure, note, panel_title, tidy

BARS = {
    "plain equilibrium": ("equilibrium, of arrays", SKY),
    "equilibrium": ("equilibrium, of tensors", BLUE),
    "gradient": ("gradient by all inputs", VERMILION),
}


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    figure = new_figure(7.5, 0.9 + 1.2 * len(results))
    axes = figure.subplots()
    width = 0.26
    for k, (name, (label, colour)) in enumerate(BARS.items()):
        positions = [row + (k - 1) * width for row in range(len(results))]
        values = [1e3 * cost[name] for cost in results.values()]
        axes.barh(positions, values, height=width, color=colour, label=label)
        for position, value, cost in zip(positions, values, results.values(), strict=True):
            text = f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
            if name == "gradient":
                text += f"  {100 * cost['share']:.1f} % of the equilibrium"
            axes.annotate(
                text,
                (value, position),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8.5,
                color=INK,
            )
    axes.set_yticks(range(len(results)), list(results))
    axes.invert_yaxis()
    axes.margins(x=0.1)
    tidy(axes, grid="x")
    axes.tick_params(axis="y", length=0, labelsize=9.5)
    panel_title(axes, "A gradient beside its equilibrium", f"ms; at most {100 * ALLOWED_SHARE:.0f} % of it")
    axes.legend(frameon=False, fontsize=8.5, labelcolor=INK, loc="lower right")
    sizes = ", ".join(dict.fromkeys(cost["size"] for cost in results.values()))
    note(figure, f"{sizes}; {machine(setting)}")
    return figure
