"""Figure of the speed of an iteration over that in the paper, one bar for each row of its table."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from .style import BLUE, FAINT, INK, machine, new_figure, note, panel_title, tidy


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    rows = [row for row in results["rows"] if not row["absent"] and row["ratio"] is not None]
    figure = new_figure(8.0, 1.6 + 0.42 * max(1, len(rows)))
    axes = figure.subplots()
    positions = range(len(rows))
    axes.barh(positions, [row["ratio"] for row in rows], color=BLUE, height=0.62)
    for position, row in zip(positions, rows, strict=True):
        axes.annotate(
            _two_digits(row["ratio"]), (row["ratio"], position), (5, 0), textcoords="offset points", va="center",
            fontsize=9, fontweight="bold", color=INK,
        )  # fmt: skip
        axes.annotate(
            f"{_seconds(row['seconds'])}, theirs {_seconds(row['paper'])}", (1.0, position), (6, 0),
            textcoords="offset points", va="center", fontsize=8, color="white",
        )  # fmt: skip
    axes.set_yticks(positions, [f"{row['name']} (Fig. {row['figure']})" for row in rows])
    axes.set(xscale="log", xlim=(1.0, 3.0 * max((row["ratio"] for row in rows), default=10.0)))
    axes.invert_yaxis()
    axes.axvline(1.0, color=FAINT, linewidth=0.8)
    panel_title(
        axes,
        "An iteration here beside the paper's",
        "how many times as fast; rows of Table 1 of Chen et al. 2022",
    )
    tidy(axes, grid="x")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="y", length=0, labelsize=9)
    note(figure, f"ours: {machine(setting)}; theirs: {results['paper_machine']}")
    return figure


def _two_digits(ratio: float) -> str:
    return f"{float(f'{ratio:.2g}'):,.4g}" if ratio < 1000 else f"{float(f'{ratio:.2g}'):,.0f}"


def _seconds(value: float) -> str:
    return f"{1e3 * value:.2g} ms" if value < 0.1 else f"{value:.2g} s" if value < 10 else f"{value:.0f} s"
