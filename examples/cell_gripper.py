"""Four arms of pneumatic cells under a drone find how to grip a ball and where to carry it."""

from pathlib import Path

from _cell_gripper.report import draw_controls, movie, picture
from _robots import report
from _robots.search import searched
from _run import run

import magshell as ms
from magshell.envs.cell_gripper import BALL_CELLS, LEVELS, STEPS, TARGET, CellGripper

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
    """{"found": [Found of each start], "motion": with the controls of the first, "forward", "backward": ms of the processor,
    a step, "slope": error of the slope at the start of the search, over so many steps, "slips": the same motion without
    friction}. difference: of the controls, which go from -1 to 1."""
    result = searched(
        CellGripper(levels, ball_cells), steps, target, episodes, starts, slope_steps, difference
    )
    slippery = CellGripper(levels, ball_cells, friction_coefficient=0.0)
    controls = result["found"][0].controls
    return {**result, "slips": slippery.way(slippery.motion(controls))}


def plot(result: dict):
    """The miss against episodes and time; what was found."""
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
