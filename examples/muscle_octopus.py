"""A soft octopus finds how sixteen muscles have to beat to take it to a target.

[Qiao21] 6.3, Figure 4b: eight legs with two muscles each, water and no gravity; in 400 steps of 5 ms the center of mass is
to go from (0, 0, 0) to (-0.4, 0.8, -0.4) m. In every step four numbers a muscle steer the wave of activation along it:
25,600 unknowns, bounded, every one of them live, found by L-BFGS.

What comes out:

                              here                                   theirs
    nodes, tetrahedra         795, 2112                              977, 2160
    until 1 % of the way      15 episodes (motion and gradient)      about 50 until it converges
    a step                    3 ms at first, 5 in the mean           4.4 to 9 ms (measured)
    its gradient              3.6 ms                                 287 to 328 ms (measured)

- From three other waves in all legs (a strength of 0.2, a depth of 0.95, waves of 0.4) it takes 15, 16 and 15 episodes;
  with noise of 0.05 in every number 12.
  Without damping of the flesh and with twice the range of delays and waves it took 22, and 21 of the steps found were
  taken in halves.
- None of the 25,600 derivatives is zero at the start of the search. The derivative of the squared miss along its gradient
  there, over all 400 steps, is that of differences to 3e-8; at what was found, a tenth of them at a bound, to 8e-7.
- The four numbers: strength (0 to 1), depth (-1 to 1), delay (a quarter of a period either way) and how many waves a leg has
  on it (0.25 to 0.75); the wave itself runs with 2 Hz. [Qiao21]'s are not told in full.
- The start is the same wave in all legs over and over; it drifts upwards by 0.2 m.
- As in the paper's code: size, Young's modulus, Poisson's ratio, mass, muscles of 5e5 Pa, 50 segments, step.
- Chosen here, as it is not told: the shape (eight times the same eighth), where the fibres run, and a damping of 2 ms of the
  flesh. Water as for the fish.
"""

from __future__ import annotations

from pathlib import Path

from _muscle_octopus.report import VIEW, draw_activations
from _robots import report
from _robots.search import EPISODES, gradient_at, searched
from _run import run
from robots.muscle_octopus import CELLS, STEPS, TARGET, MuscleOctopus

import magshell as ms

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
    """Return the search and its checks.

    {"found": [Found of each start], "motion": with the controls of the first, "forward", "backward": ms of the
    processor, a step, "slope": error of the slope at the start of the search, over `slope_steps` steps, "slope_found":
    at the controls that the first search found, "dead": how many of the unknowns have no gradient at the start}.
    difference: of the controls, which go from -1 to 1.
    """
    octopus = MuscleOctopus(cells)
    result = searched(octopus, steps, target, episodes, starts, slope_steps, difference)
    gradient = gradient_at(octopus, octopus.first_controls(steps, **starts[0]), target)
    return {**result, "dead": int((gradient == 0).sum())}


def plot(result: dict):
    """Draw the distance against episodes and time, and the activations found."""
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
    active = {"color": ms.Color("activation", range=(0, 1))}
    report.picture(result["motion"], VIEW, **active).save(out / "muscle_octopus_swims.png")
    report.movie(result["motion"], out / "muscle_octopus.gif", VIEW, speed=1.0, fps=25.0, width=500, **active)


if __name__ == "__main__":
    run(main, summary, write)
