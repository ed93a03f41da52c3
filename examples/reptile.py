"""A sheet with eight legs walks in a magnetic field that turns: on flat ground, over a bump, up a slope.

[Chen22] 6.1, "Magnetic Reptile Robot" (Figures 3c and 5), after Xu et al., Science Robotics 4 (2019). The
legs are magnetized along themselves, outwards in one pair and inwards in the next. A uniform field that
turns about the axis across the crawler lifts the pairs of one kind while it presses down those of the
other, and sways all of them along the body: each foot goes round, every second pair half a turn later.
Friction makes steps of it: the feet that stand carry the body ahead.

What comes out, in the paper's steps of 0.1 ms, in a turn of the field (0.2 s), once the first turn is
over:

    on flat ground                  4.27 mm, in 3.6 iterations a step
    up a slope of 10 degrees        2.62 mm along x, in 3.8
    over a bump of 1.2 mm           2.6 to 4.5 mm in each, in 3.7; one step of 16,000 in halves
    without friction                0.00001 mm, in steps of 1 ms
    field turned the other way      as far back, to a thousandth, in steps of 1 ms

- In steps of 1 ms it walks 4.38 mm on flat ground and 2.80 mm uphill, in 6.2 iterations each; in steps of
  2 ms 4.42 mm on flat ground, in 7.8.
- Lagged friction gives 4.270 mm instead of 4.272 in steps of 0.1 ms, 4.363 instead of 4.376 in steps of 1
  ms and 4.457 instead of 4.422 in steps of 2 ms, in about as many iterations.
- Floating, without contact, a step of 0.1 ms takes 2.0 iterations; an iteration with contact and friction
  costs 1.2 times as much as one without.
- Friction holds below a speed that is chosen: 0.5 mm/s, a fortieth of the walk's. With a twentieth of
  that, the library's default here, Newton's method fails in a step of the second turn, in whatever parts
  it is taken.
- What the paper says: numbers of faces and vertices, Young's modulus, Poisson's ratio, damping and step
  (Table 1); thickness, mass density, contact stiffness and friction (its footnote). 496 faces and 326
  vertices are 248 rectangles in halves, with 154 edges along the outline: a body of 16 x 5 with legs of 3
  x 7 has both.
- What it does not say, and is chosen here: the size, 15 x 19 mm, with legs of 1.5 x 7 mm; magnets of 40
  kA/m; a field of 8 mT that turns 5 times a second and grows from nothing in the first quarter turn; bump
  and slope. In 20 mT the body stands on end twice a turn.
- The damping of 1e-2 N s/m is taken as that of the whole sheet. On every vertex it would brake a crawler
  of this size with all its weight of 1.6 mN at 0.5 mm/s; this one walks 21 mm/s.
- Legs do not feel each other: contact is with the ground only.

Run it: prints a summary and writes pictures and movies into out/; --study compares steps and frictions as
well.
"""

from __future__ import annotations

import sys
from pathlib import Path

from _reptile.model import GROUNDS, TIME_STEP, Crawler, crawler
from _reptile.report import draw_paths, draw_progress, draw_side, movie, picture, summary
from _reptile.study import study
from _run import run

import magshell as ms

CYCLES = {"flat": 3, "bump": 8, "slope": 4}


def main(cycles=CYCLES, time_step=TIME_STEP, with_study=False) -> dict:
    """Return the motions on every ground; cycles: number of rotations of the field.

    {"walks": {ground: (Crawler, Trajectory)}, "back", "study", "time_step"}; "back" is one rotation of the field in
    the other sense, on flat ground.
    """
    walks = {name: walk(name, turns, time_step) for name, turns in cycles.items()}
    return {
        "walks": walks,
        "back": walk("flat", 1, time_step, sense=-1),
        "study": study() if with_study else [],
        "time_step": time_step,
    }


def walk(name: str, rotations: int, time_step, **options) -> tuple[Crawler, ms.Trajectory]:
    """Simulate a number of rotations of the field on one of the grounds."""
    who = crawler(GROUNDS[name]())
    return who, who.crawl(rotations, time_step=time_step, **options)


def plot(result: dict):
    """Draw the crawler from the side on each ground, and the path of its center."""
    from matplotlib import pyplot as plt

    walks = result["walks"]
    figure = plt.figure(figsize=(11, 3 + 2.2 * len(walks)), layout="constrained")
    grid = figure.add_gridspec(len(walks) + 1, 2, height_ratios=[1] * len(walks) + [1.3])
    for row, (name, (who, motion)) in enumerate(walks.items()):
        side = figure.add_subplot(grid[row, :])
        draw_side(side, who, motion, name)
        side.set_title(name, loc="left", fontweight="bold")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="upper left")
    draw_progress(figure.add_subplot(grid[-1, 0]), walks)
    draw_paths(figure.add_subplot(grid[-1, 1]), walks)
    for each in figure.axes:
        each.spines[["top", "right"]].set_visible(False)
    return figure


def animation(result: dict, name: str, path: Path, **options) -> Path:
    """Write the movie of the crawler on one of the grounds, as a .gif or an .mp4."""
    return movie(*result["walks"][name], path, name, **options)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "reptile.png", dpi=160)
    for ground, crawled in outcome["walks"].items():
        picture(*crawled).save(out / f"reptile_{ground}.png")
        animation(outcome, ground, out / f"reptile_{ground}.gif")


if __name__ == "__main__":
    run(lambda: main(with_study="--study" in sys.argv[1:]), summary, write)
