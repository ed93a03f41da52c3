"""A soft fish with a skeleton finds the torques that take it to a target.

[Qiao21] 6.3, Figure 4c: six bones (head, two in the trunk, tail, two fins), five torques, water and no gravity; in 100
steps of 20 ms the center of mass is to go 15 cm ahead. All 500 torques are unknown, bounded, and found by L-BFGS.

What comes out:

                          here                                   theirs
    nodes, tetrahedra     928, 3186                              759, 3268
    until 1 % of the way  10 episodes (motion and gradient)      about 50 until it converges
    a step                6 ms at the start, 9 ms as found       -

- Four other starts (amplitudes of 0.3 and 0.8, 1.5 Hz, a lag of 0.5) took 12, 13, 9 and 10 episodes, without the damping
  of the flesh; from three with noise of 0.05 in every torque, with it, 11, 10 and 12.
- The derivative of the squared miss along its gradient, over all 100 steps, is that of differences to 1e-8 at the start of
  the search and 2e-9 at the torques found. That is what the damping of the flesh, 2 ms, is for: without it a step takes 12
  ms, three of them are taken in halves, and differences there are worthless.
- The start is a wave of half of the largest torques along the spine. At rest the gradient is zero: water pushes with
  the square of the speed.
- As in the paper's code: size, Young's modulus, Poisson's ratio, mass, step, bones. Their 10 kg in this volume are 6.9
  times as dense as water; nothing weighs here, it is only as slow to speed up.
- Chosen here, as it is not told: the shape, the largest torques (5, 3.5, 1.8, 2.5 and 2.5 N m) and a damping of the joints.
- Water pushes on faces turned to the flow only, there; here on all, half as much. The thrust is smooth: their
  table's at 15, 50 and 90 degrees, zero at 0 (theirs 0.45), and at most 2.2 at 25 (theirs 1.8 at 15).

Run it: prints a summary and writes pictures and a movie into out/.
"""

from __future__ import annotations

from pathlib import Path

from _fish.report import VIEW, draw_torques
from _robots import report
from _robots.search import EPISODES, searched
from _run import run
from robots.fish import STEPS, TARGET, TETRAHEDRA, Fish

import magshell as ms

STARTS = (  # of the wave along the spine, beside the usual one
    {},
    {"amplitude": 0.3},
    {"frequency": 1.5},
    {"lag": 0.5},
)


def main(
    n_tetrahedra: int = TETRAHEDRA,
    steps: int = STEPS,
    target=TARGET,
    episodes: int = EPISODES,
    starts=STARTS,
    slope_steps: int = STEPS,
    difference: float = 1e-4,
) -> dict:
    """Return the search and its checks.

    {"found": [Found of each start], "motion": with the torques of the first, "forward", "backward": ms of the
    processor, a step, "slope": error of the slope at the start of the search, over `slope_steps` steps, "slope_found":
    at the torques that the first search found}. difference: of torques, over the largest.
    """
    return searched(Fish(n_tetrahedra), steps, target, episodes, starts, slope_steps, difference)


def plot(result: dict):
    """Draw the distance against episodes and time, and the torques found."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    report.draw_search(axes[0], axes[1], result["found"])
    draw_torques(axes[2], result["found"][0])
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def summary(result: dict) -> str:
    return report.summary(result, [result["found"][0].robot.flesh.mesh])


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "fish.png", dpi=160)
    report.picture(result["motion"], VIEW).save(out / "fish_swims.png")
    report.movie(result["motion"], out / "fish.gif", VIEW, speed=1.0, fps=25.0, width=500)


if __name__ == "__main__":
    run(main, summary, write)
