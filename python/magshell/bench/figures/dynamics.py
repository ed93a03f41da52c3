"""Integrators: error against steps and against time; the energy each keeps."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from .style import COLOURS, FAINT, INK, machine, new_figure, note, panel_title, tidy

_MARKERS = "osD^vP"


def draw(results: dict, setting: dict) -> Figure:
    figure = new_figure(11.0, 4.0)
    by_steps, by_time, kept = figure.subplots(1, 3, width_ratios=(1, 1, 0.9))
    errors, energies = results["errors"], results["energies"]
    looks = {
        name: {"color": colour, "marker": marker, "markersize": 4.5, "linewidth": 1.6}
        for name, colour, marker in zip(dict.fromkeys([*errors, *energies]), COLOURS, _MARKERS, strict=True)
    }
    for name, rows in errors.items():
        label = f"{name}, order {rows['order']:.1f}"
        by_steps.loglog(rows["steps"], rows["error"], label=label, **looks[name])
        by_time.loglog(rows["time"], rows["error"], **looks[name])
    by_time.sharey(by_steps)
    by_time.tick_params(labelleft=False)
    steps = next(iter(errors.values()))["steps"]
    by_steps.xaxis.set_minor_locator(NullLocator())
    by_steps.set_xticks(steps, [str(count) for count in steps])
    by_steps.set_xlabel("steps a period", fontsize=9)
    by_time.set_xlabel("time of the motion / s", fontsize=9)
    by_time.xaxis.set_minor_formatter(NullFormatter())
    by_steps.legend(frameon=False, fontsize=8, labelcolor=INK)
    panel_title(by_steps, "Error", "root mean square of the positions over the length")
    panel_title(by_time, "Error against time")
    _energies(kept, energies, looks)
    for axes in (by_steps, by_time, kept):
        tidy(axes)
    note(figure, f"a strip in a field that swells and fades; {machine(setting)}")
    return figure


def _energies(axes, energies: dict, looks: dict) -> None:
    """Of a vibration, by how far its tip swings."""
    for name, rows in energies.items():
        swings = [float(each) for each in rows["kept"]]
        shares = [float("nan") if share is None else 100 * share for share in rows["kept"].values()]
        axes.plot(swings, shares, **looks[name])
        last = next((k for k in reversed(range(len(shares))) if shares[k] == shares[k]), None)
        if last is not None:
            axes.annotate(
                name, (swings[last], shares[last]), (6, 0), textcoords="offset points", fontsize=7.5, color=FAINT,
                va="center", annotation_clip=False,
            )  # fmt: skip
    axes.set(xscale="log", ylim=(-4, 104))
    axes.set_xticks(swings, [f"{each:g}" for each in swings])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("amplitude of the tip / length", fontsize=9)
    panel_title(axes, "Energy kept / %", "over 20 periods of 40 steps")
