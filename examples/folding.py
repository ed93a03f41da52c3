"""A magnetized strip folds flat onto itself and opens again; another coils up. Both touch themselves.

The first lies on a table, clamped at its left edge: a leaf of 21 mm, a crease, and a leaf of 18 mm that is magnetized
along itself. A field of 30 mT turns from against the strip, over down, to along it, and the magnet with it, until one
leaf lies on the other. The other strip, of 80 mm, has its magnet in the last seventh, and a field of 40 mT takes that
around nearly twice.

What comes out, at rest at every angle of the field, each state from the one before:

              its end turns by   that touch, at most   with      faces that pass   bending strain
    folds         181 degrees        147 pairs           0.7 mN           0              16 %
    coils up      658                 15                 0.3              0               7

- Folded flat, the middle surface of the upper leaf lies 0.21 to 0.69 mm high, and that of the lower one at -0.2: they
  are 0.4 mm thick, and the crease holds them apart by 0.5 mm at its side. Opened again, the strip is where it began to
  1e-11 um.
- The way back is another one: nothing rubs in statics, but as it opens the magnet's edge first keeps touching the
  crease, 0.5 mN less and less, and lets go where it did not touch on the way there.
- The strip that coils up is half as thick at its end as where it is held. So its end bends more and gets inside.
- A state where nothing touches takes 3 to 55 iterations, one where parts touch or slide on each other 10 to 250:
  contact without friction leaves shallow valleys. All of it takes 3 s of processor time.

Run it: prints a summary and writes a picture and movies into out/.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from _folding.model import Strip, coiling, folding
from _folding.report import draw_angles, draw_coil, draw_folding, movie, summary
from _run import run

import magshell as ms


def main(cells=(42, 60), angles=(12, 16)) -> dict:
    """Return the numbers of both strips, in SI units. cells, angles: of the one that folds, and the one that coils
    up.
    """
    return {
        "fold": measured(folding(cells[0], angles[0])),
        "coil": measured(coiling(cells[1], angles[1])),
    }


def measured(strip: Strip) -> dict:
    began = time.process_time()
    states = strip.states()
    processor_time = time.process_time() - began
    touching = [state.contact_state(strip.touch) for state in states]
    positions = np.array([state.positions for state in states])
    mesh = strip.scene.mesh
    end = positions[:, strip.end]
    last = positions[:, mesh.vertices_at(x=mesh.rest_positions[:, 0].max())].mean(axis=1)
    way = last - end[:, np.argmin(mesh.rest_positions[strip.end, 0])]
    return {
        "strip": strip,
        "states": states,
        "positions": positions,
        "angles": strip.angles,
        "turned": np.degrees(np.unwrap(np.arctan2(way[:, 2], way[:, 0]))),
        "end_heights": end[:, :, 2].min(axis=1),
        "end_tops": end[:, :, 2].max(axis=1),
        "gaps": np.array([each.smallest_distance for each in touching]),
        "forces": np.array([each.normal_force for each in touching]),
        "pairs": np.array([len(each.pairs) for each in touching]),
        "crossings": sum(len(state.self_intersections()) for state in states),
        "least_gap": strip.touch.min_distance,
        "strain": max(state.largest_bending_strain for state in states),
        "iterations": np.array([state.iterations for state in states]),
        "processor_time": processor_time,
    }


def plot(result: dict):
    """Draw both strips, the rotation of their ends, and their contact forces."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11, 7.6), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1, 1.1, 1.1))
    draw_folding(figure.add_subplot(grid[0, :]), result["fold"])
    draw_coil(figure.add_subplot(grid[1, :]), result["coil"])
    for column, name in enumerate(("fold", "coil")):
        axes = figure.add_subplot(grid[2, column])
        draw_angles(axes, result[name], name)
        axes.spines["top"].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "folding.png", dpi=160)
    for name in ("fold", "coil"):
        movie(outcome[name], out / f"folding_{name}.gif")


if __name__ == "__main__":
    run(main, summary, write)
