"""The free end of a strip draws an L and a quarter circle, led by a magnetic field."""

from __future__ import annotations

import time
from pathlib import Path

from _tracks.fits import METHODS, cost, fitted
from _tracks.model import CELLS, TASKS, strip
from _tracks.report import draw_convergence, draw_field, draw_track, states, summary

import magshell as ms


def main(cells=CELLS, tasks=tuple(TASKS), methods=tuple(METHODS), iterations=100, progress=False) -> dict:
    """{"strip", "fits": {task: {method: Fit}}, "costs": {task: {method: ms a step}}}."""
    sheet = strip(cells)
    fits = {
        task: {
            method: fitted(sheet, TASKS[task], METHODS[method], iterations=iterations, progress=progress)
            for method in methods
        }
        for task in tasks
    }
    costs = {
        task: {method: cost(sheet, fit) for method, fit in by_method.items()}
        for task, by_method in fits.items()
    }
    return {"strip": sheet, "fits": fits, "costs": costs}


def plot(result: dict):
    """A row a curve: the strip and its tip's track beside the curve, convergence, the field in time."""
    from matplotlib import pyplot as plt

    rows = len(result["fits"])
    figure, axes = plt.subplots(
        rows, 3, figsize=(14, 4.2 * rows), width_ratios=(1.25, 1, 1), layout="constrained", squeeze=False
    )
    for (name, fits), (left, middle, right) in zip(result["fits"].items(), axes, strict=True):
        draw_track(left, result["strip"], list(fits.values())[-1])
        draw_convergence(middle, fits, name)
        draw_field(right, fits)
        left.set_title(name, loc="left", fontweight="bold")
    for each in axes.flat:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def picture(result: dict, name: str) -> ms.Picture:
    """The strip in space while it draws one of the curves, its magnetization and the field."""
    return states(result["strip"], list(result["fits"][name].values())[-1])


if __name__ == "__main__":
    began = time.perf_counter()
    outcome = main(progress=True)
    print(summary(outcome))
    out = Path("out")
    out.mkdir(exist_ok=True)
    plot(outcome).savefig(out / "track_fitting.png", dpi=200)
    for curve in outcome["fits"]:
        picture(outcome, curve).save(out / f"track_fitting_{curve}.png")
    print(f"\nPictures in {out}/; {time.perf_counter() - began:.0f} s in all.")
