"""Four arms of pneumatic cells under a drone find how to grip a ball and where to carry it.

[Qiao21] 6.3, Figure 4a: 56 cells in four arms, a drone that moves, a ball held by friction; in 50 steps of 10 ms it is to go
from (0, 0, 0) to (0, 0.3, 0) m. Unknown in every step are the volumes asked of the cells and the speed of the drone, 2950
numbers in all, bounded, found by L-BFGS.

What comes out:

                              here                                   theirs
    nodes, tetrahedra         1011, 2970                             856, 3008
    until 1 % of the way      6 episodes (motion and gradient)       10
    a step                    11 to 12 ms as found                   -
    backward over forward     0.28 to 0.45 (factors kept)            -

- From cells blown up to a quarter and to the most, and from a slower drone, it takes 10, 5 and 6 episodes; from five starts
  with noise of 0.05 in every number, as in the bench, 6, where CMA-ES has 0.28 of the way left after 60, 0.18 after 120.
  What is descended is the square of the miss: the miss itself has a kink at the target, and takes 10 to 13 episodes.
- The derivative of the squared miss along its gradient at the start, over all 50 steps and through the contact, is that of
  differences to 1.4e-7, at what was found to 5.5e-7. Closest points go over edges of cubes and ball, which `kinks` names;
  it does no harm here.
- Arms end as high as the middle of the ball. While it rises, friction bears 4 to 6 of the ball's 10 N and the
  arms, which lean inwards, the rest; without friction the same controls leave it on the table.
- A cell is the outer half of an arm at one of 14 levels, 18 tetrahedra whose common volume it sets
(ms.PneumaticCells). Volumes come
  nearer to what is asked by a fifth a step, as air takes its time: cells that jump make random actions, as learners
  try them, take 300 ms a step instead of 30.
- What the search changes is mostly the drone's way: cells blown up alike grip well enough.
- As in the paper's code: Young's modulus, Poisson's ratio, masses, step, gravity. Chosen here, as it is not told: the
  shape, of cubes, the ball's radius, a table that it lies on, the friction (0.8), the cells' stiffness and largest
  volume.
"""

from __future__ import annotations

from pathlib import Path

from _cell_gripper.report import draw_controls, movie, picture
from _robots import report
from _robots.search import searched
from _run import run
from robots.cell_gripper import BALL_CELLS, LEVELS, STEPS, TARGET, CellGripper

import magshell as ms

EPISODES = 20
STARTS = (  # cells alike, and the drone, beside the usual one
    {},
    {"inflated": 0.25},
    {"inflated": 1.0},
    {"speed": 0.05},
)


def main(
    levels: int = LEVELS,
    ball_cells: int = BALL_CELLS,
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
    at the controls that the first search found, "slips": the same motion without friction}. difference: of the
    controls, which go from -1 to 1.
    """
    result = searched(
        CellGripper(levels, ball_cells), steps, target, episodes, starts, slope_steps, difference
    )
    slippery = CellGripper(levels, ball_cells, friction_coefficient=0.0)
    controls = result["found"][0].controls
    return {**result, "slips": slippery.displacement(slippery.motion(controls))}


def plot(result: dict):
    """Draw the distance against episodes and time, and the controls that were found."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), layout="constrained")
    report.draw_search(axes[0], axes[1], result["found"])
    draw_controls(axes[2], result)
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def summary(result: dict) -> str:
    gripper = result["found"][0].robot
    told = report.summary(result, [gripper.arms.mesh, gripper.ball.mesh])
    return f"{told}\nthe same without friction: {result['slips'].round(4)} m"


def write(result: dict, out: Path) -> None:
    ms.Picture(plot(result)).save(out / "cell_gripper.png", dpi=160)
    picture(result).save(out / "cell_gripper_carries.png")
    movie(result, out / "cell_gripper.gif")


if __name__ == "__main__":
    run(main, summary, write)
