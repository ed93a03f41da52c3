"""Figure of times and memory against the number of faces, with their exponents; two threads over one."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from ..busy_machine import COMPANY, ratio
from ..scaling import ALLOWED_EXPONENT, ALLOWED_MEMORY, MEMORIES, TIMES
from .style import (
    BLUE,
    COLOURS,
    FAINT,
    GREEN,
    INK,
    SKY,
    VERMILION,
    label_bars,
    machine,
    new_figure,
    note,
    panel_title,
    tidy,
)

_TIME_COLOURS = dict(zip(TIMES, COLOURS, strict=True))
_TIME_COLOURS["iteration"] = INK
_MEMORY_COLOURS = dict(zip(MEMORIES, (GREEN, SKY, BLUE, VERMILION), strict=True))


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    one, two = (results["sizes"][threads] for threads in ("1", "2"))
    faces = [size["faces"] for size in one]
    figure = new_figure(14.5, 4.4)
    times, faster, memory, company = figure.subplots(1, 4, width_ratios=(1.35, 0.9, 1.1, 0.8))
    exponents = results["exponents"]
    for name, label in TIMES.items():
        _line(
            times,
            faces,
            [size["processor"][name] for size in one],
            _TIME_COLOURS[name],
            label,
            exponents[name],
        )
    times.set(xscale="log", yscale="log")
    panel_title(
        times,
        "Seconds of one processor",
        f"with exponents of the faces: at most {ALLOWED_EXPONENT} for an iteration",
    )
    _ends(times)

    for name, label in TIMES.items():
        ratios = [a["wall"][name] / b["wall"][name] for a, b in zip(one, two, strict=True)]
        faster.plot(faces, ratios, color=_TIME_COLOURS[name], marker="o", markersize=4, label=label)
    faster.axhline(1.0, color=FAINT, linewidth=0.8)
    faster.set(xscale="log", ylim=(0, 2.3))
    panel_title(faster, "Two threads over one", "how many times as fast; colours as on the left")

    for name, label in MEMORIES.items():
        values = [size[name] for size in one]
        if all(value is not None for value in values):
            megabytes = [value / 1e6 for value in values]
            _line(memory, faces, megabytes, _MEMORY_COLOURS[name], label, exponents[name])
    memory.set(xscale="log", yscale="log")
    panel_title(memory, "MB", f"with exponents; the process at most {ALLOWED_MEMORY} times the factor")
    _ends(memory)
    for axes in (times, faster, memory):
        tidy(axes)
        axes.set_xticks(faces, [f"{count:,}" for count in faces], rotation=35, ha="right")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("faces", fontsize=9)
    _company(company, results["busy machine"])
    note(
        figure,
        f"a square sheet bent by a field, {results['bending']}; {machine(setting).replace('1 thread, ', '')}",
    )
    return figure


def _company(axes, results: dict[str, Any]) -> None:
    """Draw the time of two threads over that of one, with the largest allowed ratios."""
    positions, ratios = range(len(COMPANY)), [ratio(results["company"][name]) for name in COMPANY]
    axes.barh(positions, ratios, color=SKY, height=0.55)
    for position, (_, _, allowed) in zip(positions, COMPANY.values(), strict=True):
        if allowed:
            axes.plot([allowed] * 2, [position - 0.36, position + 0.36], color=VERMILION, linewidth=1.6)
    label_bars(axes, positions, ratios, ".2f")
    axes.set_yticks(positions, COMPANY)
    axes.set(xlim=(0, 1.25 * max(1.15, *ratios)))
    axes.invert_yaxis()
    tidy(axes, grid=None)
    panel_title(axes, "Two threads' time over one's", f"{results['faces']} faces in motion; red: at most")


def _line(axes, faces, values, colour: str, label: str, exponent: float | None) -> None:
    """Draw a line with its name and exponent as the label."""
    text = label if exponent is None else f"{label}  {exponent:.2f}"
    axes.plot(faces, values, color=colour, marker="o", markersize=4, linewidth=1.6, label=text)


def _ends(axes) -> None:
    """Write the names at the ends of the lines, moved apart where they would overlap."""
    lines = sorted(
        (line for line in axes.lines if not line.get_label().startswith("_")),
        key=lambda line: line.get_ydata()[-1],
    )
    apart = 0.062
    low, high = (axes.transData.transform((1, y))[1] for y in axes.get_ylim())
    positions = [
        (axes.transData.transform((1, line.get_ydata()[-1]))[1] - low) / (high - low) for line in lines
    ]
    for k in range(1, len(positions)):
        positions[k] = max(positions[k], positions[k - 1] + apart)
    positions[-1] = min(positions[-1], 1.0)
    for k in reversed(range(len(positions) - 1)):
        positions[k] = min(positions[k], positions[k + 1] - apart)
    for line, position in zip(lines, positions, strict=True):
        axes.annotate(
            line.get_label(),
            (1.02, position),
            xycoords="axes fraction",
            fontsize=8,
            color=line.get_color(),
            va="center",
        )
