"""DOC"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from _reptile.model import GROUNDS, TIME_STEP, Crawler, crawler
from _reptile.report import draw_paths, draw_progress, draw_side, movie, picture, summary
from _reptile.study import study

import magshell as ms

CYCLES = {"flat": 3, "bump": 8, "slope": 4}


def main(cycles=CYCLES, time_step=TIME_STEP, with_study=False) -> dict:
    """{"walks": {ground: (Crawler, Trajectory)}, "back", "study", "time_step"}; cycles: of the field, by ground.

    "back" is the first turn on flat ground of a field that turns the other way.
    """
    walks = {name: walk(name, turns, time_step) for name, turns in cycles.items()}
    return {
        "walks": walks,
        "back": walk("flat", 1, time_step, sense=-1),
        "study": study() if with_study else [],
        "time_step": time_step,
    }


def walk(name: str, turns: int, time_step, **options) -> tuple[Crawler, ms.Trajectory]:
    who = crawler(GROUNDS[name]())
    return who, who.crawl(turns, time_step=time_step, **options)


def plot(result: dict):
    """The crawler from the side on each ground, and the way of its centre."""
    from matplotlib import pyplot as plt

    walks = result["walks"]
    figure = plt.figure(figsize=(11, 3 + 2.2 * len(walks)), layout="constrained")
    grid = figure.add_gridspec(len(walks) + 1, 2, height_ratios=[1] * len(walks) + [1.3])
    for row, (name, (who, motion)) in enumerate(walks.items()):
        side = figure.add_subplot(grid[row, :])
        draw_side(side, who, motion, name)
        side.set_title(name, loc="left", fontweight="bold")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="upper left")
    draw_progress(figure.add_subplot(grid[-1, 0]), walks)
    draw_paths(figure.add_subplot(grid[-1, 1]), walks)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def animation(result: dict, name: str, path: Path, **options) -> Path:
    """The crawler on one of the grounds, as a .gif or an .mp4."""
    return movie(*result["walks"][name], path, name, **options)


if __name__ == "__main__":
    began = time.perf_counter()
    outcome = main(with_study="--study" in sys.argv[1:])
    print(summary(outcome))
    out = Path("out")
    out.mkdir(exist_ok=True)
    plot(outcome).savefig(out / "reptile.png", dpi=160)
    for ground, crawled in outcome["walks"].items():
        picture(*crawled).save(out / f"reptile_{ground}.png")
        animation(outcome, ground, out / f"reptile_{ground}.gif")
    print(f"\nPictures and movies in {out}/; {time.perf_counter() - began:.0f} s in all.")
