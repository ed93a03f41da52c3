"""A soft octopus swims through two pipes and a tunnel, driven by a magnetic field in time: [Chen22] Fig. 10 and 11.

A bullet-shaped head of thin shell, open at the back, with six tentacles that are magnets along themselves, hangs in
water as heavy as itself. A uniform field in time opens and closes the tentacles; their strokes push it on through a
channel with a throat. What is looked for, as in the paper's section 6.3, is the field of every step, 3000 of 1 ms, which
is 9000 unknowns, from no field at all: it is to bring the mass center along the channel in time, at little cost of field.

Why one search of all steps ends: a field that opens the tentacles would rather turn the octopus around, so its motion along
the axis is unstable. In a swing of 12 mT at 4 Hz, what a change of Bx does to the way forward does not grow, 0.04 to 0.8 m/T
for horizons of 200 to 1200 steps; what a change of By does to the way aside grows from 0.2 to 4500 m/T in pipe II, tenfold
in 0.2 s, and to 6100 in open water: contact is not the cause. At that rate noise of 1e-12 m would be a millimeter after
2 s, the motion depends on rounding, and gradients over it tell nothing that a search can use.
So `ms.control.receding_horizon` looks 0.4 s ahead, where noise grows a hundredfold, does 0.2 s of what it
found, and begins again
from where that led: what went aside is led back by By and Bz, the field found has feedback in it. As a field that is
zero does nothing to first order, five more plans are tried before each search: swings of up to 12 mT, or earlier strokes
once more. The gradient over such a horizon in the throat of pipe I agrees with differences to 2e-5 along itself.

What comes out, from starts with noise of 1e-12 m (--noise 1e-12): ten searches a channel (--seed 1 to 10; the
settings were chosen on seed 0), which differ by that noise and by what is tried. All 30 pass, and each field found passes
in the same step when the motion is simulated in one piece. Median, least and most; gradients are of 400 steps each:

            passes after [s]        horizons   gradients   tried      processor [s]    aside, at most [mm]
    pipe I      1.25, 0.96 to 1.87   5 to 10    20 to 49    30 to 60   128, 83 to 174   0.14, up to 0.69
    pipe II     1.38, 1.24 to 1.78   7 to 9     30 to 39    42 to 54   118, 110 to 156  0.08, up to 0.29
    tunnel      1.41, 1.25 to 1.78   7 to 9     30 to 46    42 to 54   135, 112 to 181  0.16, up to 0.95

An iteration takes 8 s at most, trials and all. With seed 0's field of pipe I, five more starts with other noise of 1e-12 m
pass in the same step and end within 3e-8 mm.

What gradients are worth. The channels do not ask for much: an even swing of 6 mT at 4 Hz passes all three, after 1.92, 1.94
and 1.79 s, and one of 10 mT passes pipe I after 1.26 s with as much field (63 mT2 s until then; what was found in 1.14 s,
68). Of what a horizon's search gains, most comes from the trials: in 14 horizons of two searches the best of five has
0.46 of the objective that the plan as it was has, and the gradient search 0.80 of that (geometric means).
Even swings have no feedback, though, and pass only from a start that is all but exact. Pipe I, seed 1:

    noise in the start     even 6 mT        even 10 mT                           receding
    1e-12 m                1.92 s           1.26 s, nose  0.00002 mm aside       1.14 s
    1e-6 m                 1.92 s           1.29 s, nose 10 mm aside
    1e-5 m                                  1.44 s, nose  8 mm aside
    1e-4 m                 not in 2.2 s     not in 1.6 s, nose 11 mm aside       1.23 s, nose 0.4 mm aside

From 1e-4 m the same without gradients and as many motions (--without-gradients) passes after 1.22 s, in 120 s of the
processor instead of 147: what passes is planning again from where the motion is, by trials. Gradients add steering, as
trials are of Bx alone: over the last 0.2 s the center is 0.09 mm aside with them, 0.31 mm without. With By and Bz of the
field found, 0.04 mT at most, set to zero the nose is 2.5 mm aside on the way instead of 0.4. One run each.

On a processor that others share, a motion of 3000 steps takes 7 to 9 s, and its gradient 4 s more. The paper: 500 to 900 s
an iteration on six cores.

- As in the paper: 492 faces and 313 vertices, Y, nu, thickness, density, time step, contact stiffness and friction,
  water, implicit Euler, hinges for bending, the field's limit. The octopus weighs what its water weighs: no gravity.
- What the paper does not print, and is chosen here: all sizes (34 mm long at rest and as wide; throats of 25 to 32 mm),
  40 kA/m in the tentacles, the path asked for, weights, and the trials. To be late on the path costs, to be early does not;
  how far center and nose are from the axis counts tenfold. Instead of the paper's DMP term, which ties all of the time
  together, the field's rate costs.
- A channel counts as passed when all of the octopus is beyond its narrow part for the first time. It then has its
  tentacles folded forward, past the head. The search ends there; the field goes on as planned last, then is zero.
  Nothing keeps tentacles and head from going through each other.
- At 12 mT the tentacles' ends bend to strains of a third, beyond what the model is for, as its warning says.
- Contacts begin over 0.2 mm and stick below 5 mm/s.

Run it: prints a summary and writes a picture and movies into out/. It takes two to four minutes a channel.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from _octopus.channels import CHANNELS
from _octopus.report import draw_field, draw_path, draw_search, draw_snapshot, movie, summary
from _octopus.task import Swim
from _run import run

import magshell as ms

STEPS = 3000
SNAPSHOTS = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the time until the channel is passed


def main(
    channels=tuple(CHANNELS),
    steps: int = STEPS,
    goal=None,
    noise: float = 0.0,
    seed: int = 0,
    gradients: bool = True,
    progress=False,
) -> dict[str, dict]:
    """Return the numbers of every channel, in SI units.

    goal: m, instead of the channels' own, for shorter motions. noise: m, at the start; seed: of it, and of the trials
    of the search. gradients: False for random trials only, with as many motions.
    """
    torch.set_num_threads(1)
    results = {}
    for name in channels:
        swim = Swim.of(CHANNELS[name], steps, noise=noise, seed=seed, gradients=gradients)
        swim.goal = swim.goal if goal is None else goal
        began = time.process_time()
        found = swim.solve(progress=progress)
        processor_time = time.process_time() - began
        results[name] = {
            "channel": swim.channel,
            "body": swim.body,
            "outline": swim.channel.outline(),
            "times": np.append(0.0, swim.times),
            "path": swim.path(np.arange(steps + 1)),
            "swing": measured(swim, swim.swing()),
            "found": measured(swim, found.controls.numpy()),
            "search": found,
            "processor_time": processor_time,
        }
    return results


def measured(swim: Swim, field: np.ndarray) -> dict:
    """Simulate and measure one motion of all steps: the mass center, the last tip, and the time of passing [s], or
    None.
    """
    began = time.process_time()
    move = swim.move(field)
    processor_time = time.process_time() - began
    beyond = swim.passed(move.positions)
    magnitudes = np.linalg.norm(field, axis=1)
    return {
        "field": field,
        "positions": move.positions,
        "center": swim.center(move.positions).numpy(),
        "tail": move.positions[:, :, 0].min(axis=1),
        "passed": float(move.times[beyond[0]]) if beyond.size else None,
        "deepest": float(-swim.channel.tube().signed_distance(move.positions).min()),
        "strongest": float(magnitudes.max()),
        "rms": float(np.sqrt((magnitudes**2).mean())),
        "halved": len(move.substeps),
        "newton": move.iterations / swim.steps,
        "processor_time": processor_time,
    }


def plot(results: dict[str, dict]):
    """Draw one column for each channel: the octopus at five times, its path, the field, and the search."""
    from matplotlib import pyplot as plt

    rows = len(SNAPSHOTS) + 3
    heights = [1.25] * len(SNAPSHOTS) + [2.4, 1.5, 1.7]
    figure, axes = plt.subplots(
        rows,
        len(results),
        figsize=(6.0 * len(results), 1.1 * sum(heights)),
        height_ratios=heights,
        layout="constrained",
        squeeze=False,
    )
    for column, (name, result) in zip(axes.T, results.items(), strict=True):
        for each, share in zip(column, SNAPSHOTS, strict=False):
            draw_snapshot(each, result, share * shown_until(result))
        column[0].set_title(name, loc="left", fontweight="bold")
        for draw, each in zip((draw_path, draw_field, draw_search), column[len(SNAPSHOTS) :], strict=True):
            draw(each, result)
            each.spines[["top", "right"]].set_visible(False)
    return figure


def shown_until(result: dict) -> float:
    """Return the time at which the channel is passed, or the end, s."""
    passed = result["found"]["passed"]
    return result["times"][-1] if passed is None else passed


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "octopus.png", dpi=130)
    for channel, result in outcome.items():
        movie(result, out / f"octopus_{channel.replace(' ', '_')}.gif")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--channels", nargs="+", choices=list(CHANNELS), default=list(CHANNELS))
    parser.add_argument("--noise", type=float, default=0.0, help="m, of every coordinate in the start")
    parser.add_argument("--seed", type=int, default=0, help="of the noise and of what the search tries")
    parser.add_argument(
        "--without-gradients", action="store_true", help="trials only, as many motions as with gradients"
    )
    asked = parser.parse_args()
    options = {"noise": asked.noise, "seed": asked.seed, "gradients": not asked.without_gradients}
    run(lambda: main(asked.channels, **options, progress=True), summary, write)
