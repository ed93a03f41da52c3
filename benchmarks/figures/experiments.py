"""Figure of the searches: objective against simulations and time, of each task and method; memory over steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from .style import COLOURS, FAINT, INK, machine, new_figure, note, panel_title, tidy

_BY_GRADIENT = ("L-BFGS", "MMA", "Adam")


_ROW = 3  # tasks in a row; with more tasks, only the curves over simulations are drawn


def draw(results: dict[str, Any], setting: dict[str, Any]) -> Figure:
    tasks, memory = results["tasks"], results.get("memory")
    panels = len(tasks) + bool(memory)
    both = len(tasks) <= _ROW
    columns = max(panels, 1) if both else _ROW
    rows = (2 if tasks else 1) if both else -(-panels // _ROW)
    if panels == 1 and tasks:  # curves over simulations and over time, side by side
        rows, columns = 1, 2
    figure = new_figure(3.6 * columns, 3.0 * rows if rows > 1 else 3.2)
    axes = figure.subplots(rows, columns, squeeze=False)
    first_panels = axes[0] if both else axes.ravel()
    of_time = axes[-1] if rows > 1 else axes[0, 1:]
    looks = _looks(tasks)
    for k, (name, task) in enumerate(tasks.items()):
        _curves(first_panels[k], task, looks, "simulations")
        if both:
            _curves(of_time[k], task, looks, "seconds")
        panel_title(first_panels[k], name, f"{task['unknowns']} unknowns, {_describe_runs(task)}")
    if memory:
        _memory(first_panels[len(tasks)], memory)
    unused = first_panels[panels:] if not both else axes[1:, -1] if memory and rows > 1 else []
    for each in unused:
        each.set_visible(False)
    for each in axes.ravel():
        tidy(each)
    if tasks:
        shown: dict = {}
        for each in first_panels[: len(tasks)]:
            shown |= {label: handle for handle, label in zip(*each.get_legend_handles_labels(), strict=True)}
        labels = [name for name in looks if name in shown]
        figure.legend(
            [shown[label] for label in labels],
            labels,
            frameon=False,
            fontsize=8,
            labelcolor=INK,
            ncols=5,
            loc="outside upper center",
        )
    note(figure, f"lowest objective so far; {machine(setting)}")
    return figure


def _describe_runs(task: dict[str, Any]) -> str:
    """Say how many runs the curves show; methods may have different numbers of them."""
    counts = {len(found["runs"]) for found in task["methods"].values() if found.get("runs")} or {0}
    fewest, most = min(counts), max(counts)
    many = str(most) if fewest == most else f"{fewest} to {most}"
    return "one run" if most == 1 else f"mean and range of {many} runs"


def _looks(tasks: dict[str, Any]) -> dict[str, Any]:
    names = list(dict.fromkeys(name for task in tasks.values() for name in task["methods"]))
    colours = (*COLOURS, "#7F7F7F", "#B07AA1", "#000000")
    return {
        name: {"color": colour, "linewidth": 2.0 if name in _BY_GRADIENT else 1.2}
        for name, colour in zip(names, colours, strict=False)
    }


def _curves(axes, task: dict[str, Any], looks: dict[str, Any], of_what: str) -> None:
    for name, found in task["methods"].items():
        runs = found.get("runs")
        if not runs:
            continue
        length = max(len(each["best"]) for each in runs)
        best = np.array([_filled(each["best"], length) for each in runs])
        along = np.arange(1, length + 1)
        if of_what == "seconds":
            along = np.median([_filled(each["seconds"], length) for each in runs], axis=0)
        axes.plot(along, best.mean(axis=0), label=name, **looks[name])
        axes.fill_between(
            along, best.min(axis=0), best.max(axis=0), color=looks[name]["color"], alpha=0.15, lw=0
        )
    if task["goal"]:
        axes.axhline(task["goal"], color=FAINT, linewidth=0.8, linestyle=":")
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("simulations" if of_what == "simulations" else "time of the processor / s", fontsize=9)


def _filled(values: list[Any], length: int) -> np.ndarray:
    """Extend a run that ended early by its last value."""
    return np.array([*values, *[values[-1]] * (length - len(values))])


def _memory(axes, rows: list[dict[str, Any]]) -> None:
    steps = [row["steps"] for row in rows]
    for (storage, name), colour in zip(
        {"factors": "factors kept", "stages": "states kept", "checkpoints": "checkpoints"}.items(),
        COLOURS,
        strict=False,
    ):
        axes.plot(steps, [row[storage]["bytes"] / 1e6 for row in rows], "o-", color=colour, label=name)
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("steps", fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    panel_title(axes, "Kept for a gradient / MB", "the arch bridge")
