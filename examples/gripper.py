"""A magnetized sheet of four arms closes around a ball and lifts it, with a magnetization found by gradient.

Four arms of 12 mm around a square of 6 mm, 0.5 mm thick, above a soft ball of 12 mm. In a field of 40 mT that points
down, the remanent magnetization of every face, at most 60 kA/m a component, is to lay the arms around the ball: least is
the mean squared distance of the vertices from where they would lie close to it all the way. Each design's shape is an
equilibrium with contact of sheet and ball, frictionless, and its gradient goes through that contact. Then the motion: the
ball lies free on a table, the field rises in 0.16 s, the arms close, and the middle of the sheet goes up by 20 mm. Now
only friction and the arms below its equator hold the ball.

What comes out:

- The search comes from 1.04 to 0.13 mm rms in 6 iterations and 3.5 s of processor time, for 288 faces.
- A printer that knows six directions and one strength does as well: from that design, with every face fully magnetized along
  an axis, ms.minimize_printable comes to 0.12 mm in 66 evaluations; rounded at once it would be 0.18. It lifts the ball.
- The sheet's middle rises by 20 mm and the ball by 19.8. With the magnetization that the search began with, which is
  along the arms everywhere, they hang straight down and the ball stays where it is.
- Sheet and ball press on each other with 23 mN at most; the ball weighs about 4. They never come nearer than 0.298 mm, where
  0.25, half the thickness, is what always stays between them. A step takes 13 ms of processor time, and 1.7 times that with
  the contact of the arms with each other.
- The magnetization found is largest next to the middle.
- The arms cannot pass through each other: the sheet has an ms.SelfContact. These do not meet; arms of 18 mm whose ends
  curl under the ball do, and none of their faces pass (without it hundreds).
- The search's minima are local, and the magnetization found has no fourfold symmetry, though the scene has all but the
  mesh's.

Run it: prints a summary and writes a picture and a movie into out/.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import torch
from _gripper.lift import closing_and_lift
from _gripper.model import FIELD, LIMIT, Gripper
from _gripper.report import draw_convergence, draw_design, draw_lift, draw_motion, movie, summary
from _run import run

import magshell as ms

BEGIN = 20e3  # A/m, outwards along the arms: the start of the search


def main(cell: float = 1.5e-3, iterations: int = 6, steps: int = 150) -> dict:
    """Return the numbers of design and motion, in SI units. cell: edge length of the sheet's mesh, m."""
    gripper = Gripper(cell)
    found = designed(gripper, iterations)
    to_print = printed(gripper, found["remanent_magnetization"], iterations)
    return {
        "gripper": gripper,
        "design": found,
        "printed": to_print,
        "lift": closing_and_lift(gripper, found["remanent_magnetization"], steps),
        "lift_printed": closing_and_lift(gripper, to_print.remanent_magnetization.numpy(), steps),
        "without": closing_and_lift(gripper, BEGIN * gripper.outwards, steps),
    }


def designed(gripper: Gripper, iterations: int) -> dict:
    """Search for the magnetization by L-BFGS; the objective is in mm2."""
    mismatch = Mismatch(gripper)

    def objective(fraction: torch.Tensor) -> torch.Tensor:
        return mismatch(LIMIT * fraction)

    share = torch.from_numpy(BEGIN / LIMIT * gripper.outwards).requires_grad_()
    began = time.process_time()
    best = ms.minimize(
        objective,
        [share],
        ms.optim.LBFGS([share], lower=-1.0, upper=1.0),
        max_iterations=iterations,
        progress=False,
    )
    return {
        "remanent_magnetization": LIMIT * share.detach().numpy(),
        "history": np.array([record.objective for record in best.history]),
        "objective": best.objective,
        "seconds": time.process_time() - began,
    }


def printed(gripper: Gripper, begin: np.ndarray, iterations: int) -> ms.PrintableMinimum:
    """Search for a printable magnetization: every face in one of six directions, at full strength."""
    mismatch = Mismatch(gripper)
    ink = ms.PrintableSet(LIMIT, np.vstack([np.eye(3), -np.eye(3)]), levels=(1,))
    return ms.minimize_printable(
        mismatch,
        begin,
        ink,
        max_iterations=iterations,
        blocks=6,
        stage_iterations=4,
        exchanges=0,
        stateful=[mismatch.at_rest],
        progress=False,
    )


class Mismatch:
    """The mean squared distance from the wrapped shape, mm2, as a function of a magnetization, (n_f, 3) A/m."""

    def __init__(self, gripper: Gripper):
        self.sheet, self.wanted = gripper.sheet, torch.from_numpy(gripper.wrapped)
        self.at_rest = ms.WarmStart(gripper.closing)

    def __call__(self, remanent_magnetization: torch.Tensor) -> torch.Tensor:
        magnetization = {self.sheet: {"remanent_magnetization": remanent_magnetization}}
        shape = self.at_rest(applied_flux_density=FIELD, values=magnetization)
        return 1e6 * ((shape.positions[: len(self.wanted)] - self.wanted) ** 2).sum(1).mean()


def plot(result: dict):
    """Draw the magnetization found, the search, the arms closing and lifting, and the heights of ball and sheet."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11, 7.2), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=(0.8, 1))
    draw_lift(figure.add_subplot(grid[0, :]), result)
    draw_design(figure.add_subplot(grid[1, 0]), result)
    draw_convergence(figure.add_subplot(grid[1, 1]), result)
    draw_motion(figure.add_subplot(grid[1, 2]), result)
    for axes in figure.axes[-2:]:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "gripper.png", dpi=160)
    movie(outcome["lift"], out / "gripper.gif")


if __name__ == "__main__":
    run(main, summary, write)
