"""A soft figure with five bones falls on its feet and lifts its arms.

[Qiao21] 6.2, Figure 1: what a skeleton is good for. A figure of 10 kg and 0.8 kPa in a T pose is dropped, and its
shoulders are driven to a Y pose. Four kinds: without a skeleton; rigid, where every vertex belongs to one of the five
bones; passive, with bones inside the flesh; and driven. 100 steps of 10 ms, five starts that differ in height and
velocity.

What comes out, means and standard deviations over the starts, theirs in brackets; 808 nodes and 2962 tetrahedra:

                  bone length                   body length                      joint angles [rad]            a step [ms]
    no skeleton   0.12 +- 0.02 (0.13 +- 0.02)   0.042 +- 0.01    (0.20 +- 0.14)  2.1 +- 0.2 (2.45 +- 0.87)     8.0 (132)
    rigid         2e-16        (0)              0.00001          (0.07)          1.6 +- 0.001 (1.81)           3.1 (727)
    passive       2e-16        (0)              0.0016 +- 0.0008 (0.04 +- 0.03)  1.4 +- 0.02 (2.34 +- 0.78)    9.2 (163)
    driven        3e-16        (0)              0.0011 +- 0.0004 (0.05 +- 0.03)  0.05 +- 0.007 (0.41 +- 0.30)  12 (191)

- A bone's length error is the largest change of a bone's length, of the vertices that the bone has in the other kinds;
  the body's that of the distance from soles to crown; both over what it is at rest, after 1 s. Joint angles: the sum
  over shoulders and hips of what is missing to 0.8 and 0 rad. The paper does not say how its own are made of the four.
- Shoulders follow a servo of at most 20 N m in the air and 150 N m on the ground, the limits of the authors' code. The
  paper has another control, which is not told in full.
- As in the paper's code: Young's modulus, Poisson's ratio, mass, friction, step, joints about the front axis, counts and
  size. The shape is made here, of capsules and ellipsoids.
- The height of the hands after 1 s has an exact gradient by the torque limit of every step, through landing and
  friction: its slope is that of differences to 1e-6.

Run it: prints a summary and writes pictures and a movie into out/.
"""

from __future__ import annotations

from pathlib import Path

from _humanoid.body import TETRAHEDRA, Body
from _humanoid.fall import KINDS, STEPS, Figure, fallen, slope_error, starts
from _humanoid.report import draw_angles, draw_errors, movie, picture, summary
from _run import run

import magshell as ms


def main(
    kinds=KINDS, n_tetrahedra: int = TETRAHEDRA, n_starts: int = 5, steps: int = STEPS, slope=True
) -> dict:
    """Return the falls of every kind of skeleton.

    {"body": Body, "falls": {kind: [Fall, one a start]}, "slope": error of the slope, or None}.
    """
    body = Body.of(n_tetrahedra)
    figures = {kind: Figure(body, kind) for kind in kinds}
    falls = {
        kind: [fallen(figure, start, steps) for start in starts(n_starts)] for kind, figure in figures.items()
    }
    told = slope_error(figures["driven"], starts(1)[0], steps) if slope and "driven" in figures else None
    return {"body": body, "falls": falls, "slope": told}


def plot(result: dict):
    """Draw the angle of the right shoulder over time, and the errors of the joint angles."""
    from matplotlib import pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    draw_angles(left, result)
    draw_errors(right, result)
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "humanoid.png", dpi=160)
    for kind, falls in outcome["falls"].items():
        picture(falls[0]).save(out / f"humanoid_{kind.replace(' ', '_')}.png")
    movie(outcome["falls"]["driven"][0], out / "humanoid.gif")


if __name__ == "__main__":
    run(main, summary, write)
