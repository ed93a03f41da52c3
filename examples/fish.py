"""A soft fish with a skeleton finds the torques that take it to a target.

DOC
Run it: prints a summary and writes pictures and a movie into out/.
"""

from __future__ import annotations

import time
from pathlib import Path

from _fish.report import draw_search, draw_torques, movie, picture, summary
from _fish.search import EPISODES, first_torques, found_by_gradient, slope_error
from _run import run

import magshell as ms
from magshell.envs.fish import STEPS, TARGET, TETRAHEDRA, Fish


def main(
    n_tetrahedra: int = TETRAHEDRA,
    steps: int = STEPS,
    target=TARGET,
    episodes: int = EPISODES,
    slope_steps: int = STEPS,
    difference: float = 1e-4,
) -> dict:
    """{"found": Found, "motion": with its torques, "milliseconds": of the processor, a step, "slope": error of the slope
    at the start of the search, over so many steps}. difference: of torques, over the largest."""
    fish, start = Fish(n_tetrahedra), first_torques(steps)
    found = found_by_gradient(fish, start, target, episodes)
    began = time.process_time()
    motion = fish.motion(found.controls)
    return {
        "found": found,
        "motion": motion,
        "milliseconds": 1e3 * (time.process_time() - began) / steps,
        "slope": slope_error(fish, first_torques(slope_steps), difference),
        "slope_steps": slope_steps,
    }


def plot(result: dict):
    """The miss against episodes; the torques found."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    draw_search(left, result["found"])
    draw_torques(right, result["found"])
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "fish.png", dpi=160)
    picture(result["motion"]).save(out / "fish_swims.png")
    movie(result["motion"], out / "fish.gif")


if __name__ == "__main__":
    run(main, summary, write)
