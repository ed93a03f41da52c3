"""A soft octopus finds how sixteen muscles have to beat to take it to a target."""

from pathlib import Path

from _muscle_octopus.report import VIEW, draw_activations
from _robots import report
from _robots.search import EPISODES, gradient_at, searched
from _run import run

import magshell as ms
from magshell.envs.muscle_octopus import CELLS, STEPS, TARGET, MuscleOctopus

STARTS = (  # of the wave in all legs, beside the usual one
    {},
    {"strength": 0.2},
    {"depth": 0.95},
    {"waves": 0.4},
)


def main(
    cells: int = CELLS,
    steps: int = STEPS,
    target=TARGET,
    episodes: int = EPISODES,
    starts=STARTS,
    slope_steps: int = STEPS,
    difference: float = 1e-3,
) -> dict:
    """{"found": [Found of each start], "motion": with the controls of the first, "forward", "backward": ms of the processor,
    a step, "slope": error of the slope at the start of the search, over so many steps, "dead": how many of the unknowns
    have no gradient there}. difference: of the controls, which go from -1 to 1."""
    octopus = MuscleOctopus(cells)
    result = searched(octopus, steps, target, episodes, starts, slope_steps, difference)
    gradient = gradient_at(octopus, octopus.first_controls(steps, **starts[0]), target)
    return {**result, "dead": int((gradient == 0).sum())}


def plot(result: dict):
    """The miss against episodes and time; the activations found."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    report.draw_search(axes[0], axes[1], result["found"])
    draw_activations(axes[2], result["found"][0])
    for each in axes[:2]:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def summary(result: dict) -> str:
    told = report.summary(result, [result["found"][0].robot.flesh.mesh])
    return f"{told}\nunknowns without a gradient at the start: {result['dead']}"


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "muscle_octopus.png", dpi=160)
    report.picture(result["motion"], VIEW).save(out / "muscle_octopus_swims.png")
    report.movie(result["motion"], out / "muscle_octopus.gif", VIEW, speed=1.0, fps=25.0, width=500)


if __name__ == "__main__":
    run(main, summary, write)
