"""The free end of a strip draws an L and a quarter circle, led by a magnetic field.

[Chen22] 6.1, "Track Fitting" (Figure 7): a strip of 768 faces is clamped at its left end; a uniform field in
time, within 50 mT a component, leads the middle of its free end along two perpendicular segments, and along a
quarter circle. The objective has three terms: the distances from the curve's start and from its end at the
steps where the tip should be there, and from the curve at all steps in between.

What comes out, after 100 iterations: the weighted sum of squared distances [m2], how far the tip is from the
curve at most [mm], and, replayed: that sum when the strip moves in the same field and time is resolved
finely.

                                            L                             C
    a value a step, MMA            5.1e-6   1.13   1.6e-5       1.9e-6   0.23   6.8e-6
    spline, L-BFGS                 5.9e-7   0.29   4.5e-5       3.1e-9   0.02   2.0e-5
    spline, L-BFGS, second order   5.5e-7   0.28   5.5e-7       2.5e-8   0.05   4.9e-8
    paper (no unit)                3.8e-5                       2.3e-5

- The first row does as the paper did: implicit Euler, and MMA for the field of every step. Splines of 20
  control points need fewer iterations and give fields without jumps. What an L leaves is its corner, which
  the tip rounds.
- Implicit Euler damps: the strip that it computes is up to 0.9 mm away from where the same field would take
  it, more than the splines leave. With the second-order integrator, at twice the cost, that is 0.06 mm at
  most, and the track is the strip's own.
- An iteration takes 0.7 s (C) and 1.2 s (L) of processor time on one core with implicit Euler, twice that
  with the second-order integrator (the paper: 66 and 95 s on six cores).
- What the paper says: mesh, Young's modulus, Poisson's ratio, damping and step (Table 1). 768 faces and 417
  vertices are 24 x 8 cells of four faces, of no other regular grid. Its 0.5 k and 0.3 k unknowns, three a
  step, are 167 and 100 steps.
- What it does not say, and is chosen here: a strip of 30 x 10 x 1 mm, 1100 kg/m3, remanence 25 mT, along the
  strip in the half at the clamp and through its thickness in the other, so that B_z bends the one and B_x the
  other; the curves (8 mm each way), when the tip starts on them, and the weights (10, 10, 1). Its residuals
  have no unit.

Run it: prints a summary and writes pictures and movies into out/.
"""

from __future__ import annotations

from pathlib import Path

from _run import run
from _tracks.fits import METHODS, cost, fitted
from _tracks.model import CELLS, TASKS, strip
from _tracks.report import draw_convergence, draw_field, draw_track, movie, states, summary

import magshell as ms


def main(cells=CELLS, tasks=tuple(TASKS), methods=tuple(METHODS), iterations=100, progress=False) -> dict:
    """Return the fits and their costs.

    {"strip", "fits": {task: {method: Fit}}, "costs": {task: {method: ms a step}}}.
    """
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
    """Draw one row for each curve: the strip and its tip's track, convergence, and the field in time."""
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
    """Draw the strip in space while it follows one of the curves, with its magnetization and the field."""
    return states(result["strip"], list(result["fits"][name].values())[-1])


def animation(result: dict, name: str, path: Path) -> Path:
    """Write the movie of the strip while it follows one of the curves, as a .gif or an .mp4."""
    return movie(result["strip"], list(result["fits"][name].values())[-1], path)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "track_fitting.png", dpi=200)
    for curve in outcome["fits"]:
        picture(outcome, curve).save(out / f"track_fitting_{curve}.png")
        animation(outcome, curve, out / f"track_fitting_{curve}.gif")


if __name__ == "__main__":
    run(lambda: main(progress=True), summary, write)
