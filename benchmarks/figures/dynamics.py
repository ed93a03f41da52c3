"""Figure of the integrators: error against steps and against time, and the energy that each loses."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

from .style import COLOURS, INK, machine, new_figure, note, panel_title, tidy

_MARKERS = "osD^"


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    figure = new_figure(11.5, 4.3)
    by_steps, by_time, lost = figure.subplots(1, 3, width_ratios=(1, 1, 0.9))
    errors, energies = results["errors"], results["energies"]
    looks = {
        name: {"color": colour, "marker": marker, "markersize": 4.5, "linewidth": 1.6}
        for name, colour, marker in zip(errors, COLOURS, _MARKERS, strict=False)
    }
    for name, rows in errors.items():
        by_steps.loglog(rows["steps"], rows["error"], **looks[name])
        by_time.loglog(rows["time"], rows["error"], **looks[name])
    by_time.sharey(by_steps)
    by_time.tick_params(labelleft=False)
    steps = next(iter(errors.values()))["steps"]
    by_steps.xaxis.set_minor_locator(NullLocator())
    by_steps.set_xticks(steps, [str(count) for count in steps])
    by_steps.set_xlabel("steps a period", fontsize=9)
    by_time.set_xlabel("time of the motion / s", fontsize=9)
    by_time.xaxis.set_minor_formatter(NullFormatter())
    panel_title(by_steps, "Error", "root mean square of the positions over the length")
    panel_title(by_time, "Error against time", "the same")
    _energies(lost, energies, looks)
    panel_title(lost, "Energy lost / %", f"over {results['periods']} periods of 40 steps")
    for axes in (by_steps, by_time, lost):
        tidy(axes)
    orders = {name: f"{name}, order {rows['order']:.1f}" for name, rows in errors.items()}
    handles, names = lost.get_legend_handles_labels()
    labels = [orders[name] for name in names]
    figure.legend(
        handles,
        labels,
        frameon=False,
        fontsize=8.5,
        labelcolor=INK,
        ncols=len(names),
        loc="outside upper center",
    )
    note(figure, f"a strip in a field that swells and fades; {machine(setting)}")
    return figure


def _energies(axes, energies: dict[str, Any], looks: dict[str, Any]) -> None:
    """Draw the energy lost by a vibration against its amplitude; some methods gain as little as they lose."""
    for name, rows in energies.items():
        swings = [float(each) for each in rows["kept"]]
        lost = [float("nan") if left is None else 100 * abs(1 - left) for left in rows["kept"].values()]
        axes.loglog(swings, lost, label=name, **looks[name])
    axes.set_xticks(swings, [f"{each:g}" for each in swings])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlabel("amplitude of the tip / length", fontsize=9)
