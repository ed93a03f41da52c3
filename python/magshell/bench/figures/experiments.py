"""Objective against simulations and time, of each task and method; memory over steps."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from .style import COLOURS, FAINT, INK, machine, new_figure, note, panel_title, tidy

_BY_GRADIENT = ("L-BFGS", "MMA", "Adam")


def draw(results: dict, setting: dict) -> Figure:
    tasks, memory = results["tasks"], results.get("memory")
    columns = len(tasks) + bool(memory)
    figure = new_figure(3.6 * max(columns, 1), 6.0 if tasks else 3.2)
    axes = figure.subplots(2 if tasks else 1, max(columns, 1), squeeze=False)
    looks = _looks(tasks)
    for column, (name, task) in enumerate(tasks.items()):
        for row, of_what in enumerate(("simulations", "seconds")):
            _curves(axes[row, column], task, looks, of_what)
        panel_title(
            axes[0, column], name, f"{task['unknowns']} unknowns, median and range of {results['seeds']}"
        )
    if memory:
        _memory(axes[0, -1], memory)
        for each in axes[1:, -1]:
            each.set_visible(False)
    for each in axes.ravel():
        tidy(each)
    if tasks:
        handles, labels = axes[0, 0].get_legend_handles_labels()
        for other in axes[0, 1 : len(tasks)]:
            for handle, label in zip(*other.get_legend_handles_labels(), strict=True):
                if label not in labels:
                    handles.append(handle)
                    labels.append(label)
        figure.legend(
            handles, labels, frameon=False, fontsize=8, labelcolor=INK, ncols=5, loc="outside upper center"
        )
    note(figure, f"lowest objective so far; {machine(setting)}")
    return figure


def _looks(tasks: dict) -> dict:
    names = list(dict.fromkeys(name for task in tasks.values() for name in task["methods"]))
    colours = (*COLOURS, "#7F7F7F", "#B07AA1", "#000000")
    return {
        name: {"color": colour, "linewidth": 2.0 if name in _BY_GRADIENT else 1.2}
        for name, colour in zip(names, colours, strict=False)
    }


def _curves(axes, task: dict, looks: dict, of_what: str) -> None:
    for name, found in task["methods"].items():
        runs = found.get("runs")
        if not runs:
            continue
        length = max(len(each["best"]) for each in runs)
        best = np.array([_filled(each["best"], length) for each in runs])
        along = np.arange(1, length + 1)
        if of_what == "seconds":
            along = np.median([_filled(each["seconds"], length) for each in runs], axis=0)
        axes.plot(along, np.median(best, axis=0), label=name, **looks[name])
        axes.fill_between(
            along, best.min(axis=0), best.max(axis=0), color=looks[name]["color"], alpha=0.15, lw=0
        )
    if task["goal"]:
        axes.axhline(task["goal"], color=FAINT, linewidth=0.8, linestyle=":")
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("simulations" if of_what == "simulations" else "time / s", fontsize=9)


def _filled(values: list, length: int) -> np.ndarray:
    """A run that ended early keeps what it had."""
    return np.array([*values, *[values[-1]] * (length - len(values))])


def _memory(axes, rows: list[dict]) -> None:
    steps = [row["steps"] for row in rows]
    for (keep, name), colour in zip(
        {"factors": "factors kept", "stages": "states kept", "checkpoints": "checkpoints"}.items(),
        COLOURS,
        strict=False,
    ):
        axes.plot(steps, [row[keep]["bytes"] / 1e6 for row in rows], "o-", color=colour, label=name)
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("steps", fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    panel_title(axes, "Kept for a gradient / MB", "the arch bridge")
