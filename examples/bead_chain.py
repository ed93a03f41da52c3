"""The field of magnetic beads makes the thread that carries them stiffer or softer.

Six beads of 3 mm are glued to a thread, 6 mm apart. The thread is clamped at its left end and hangs under its weight and
theirs. Each bead has a magnetic moment of 8 mA m2, along the thread or across it. There is no other field.

What comes out, the sag of the tip:

                          moments along the thread    across it
    with own field                21.9 mm              14.9 mm
    without                       19.1                 19.1

- Beads with moments across the thread repel each other. Two of them, n places of length d apart and turned by the angle f
  against each other, gain 3/8 f^2 mu_0 m^2 / (4 pi (n d)^3): the chain gets stiffer, the more the longer it is.
- Beads with moments along the thread attract each other. They press on the thread between them, which makes it softer, as
  a load on a column does.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _own_field.beads import DIAMETER, DIRECTIONS, WIDTH, chain
from _own_field.field_lines import draw_field_lines
from _run import run

import magshell as ms

BOX = (-6e-3, 46e-3, -32e-3, 12e-3)  # m, of the pictures of field lines


def main(cells=4) -> dict:
    """Return the sag of the tip [m], the state, its energies [J] and its beads, for both directions and with and without own
    field.
    """
    found: dict = {}
    for moments in DIRECTIONS:
        for own in (True, False):
            hung = chain(moments, own, cells)
            state = hung.hanging()
            energies = ms.field_of(state).energies
            found[moments, own] = {
                "sag": hung.sag(state),
                "state": state,
                "energies": energies,
                "beads": hung.beads,
            }
    return found


def plot(result: dict):
    """Draw the field lines of both chains with their own field, and the thread without it."""
    from matplotlib import pyplot as plt

    figure, row = plt.subplots(1, 2, figsize=(11, 5.2), layout="constrained", sharey=True)
    for axes, moments in zip(row, DIRECTIONS, strict=True):
        one = result[moments, True]
        draw_field_lines(axes, one["state"], WIDTH / 2, BOX)
        without = result[moments, False]["state"]
        mesh = without.scene.mesh
        line = mesh.vertices_at(y=WIDTH / 2)
        line = line[np.argsort(mesh.rest_positions[line, 0])]
        x, _, z = 1e3 * np.asarray(without.positions)[line].T
        axes.plot(x, z, "--", color="#888888", lw=1.6)
        for bead in one["beads"]:
            at = 1e3 * np.asarray(one["state"][bead].center)
            axes.add_patch(plt.Circle((at[0], at[2]), 0.5e3 * DIAMETER, color="#c0392b", zorder=3))
        axes.set_title(f"moments {moments} the thread; dashed: without own field", loc="left", fontsize=10)
    row[0].set_ylabel("z [mm]")
    return figure


def summary(result: dict) -> str:
    lines = ["A chain of six beads"]
    for moments in DIRECTIONS:
        own, without = (1e3 * result[moments, each]["sag"] for each in (True, False))
        lines.append(
            f"  moments {moments} the thread: the tip sags by {own:.1f} mm with own field, {without:.1f} without"
        )
    return "\n".join(lines)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "bead_chain.png", dpi=160)


if __name__ == "__main__":
    run(main, summary, write)
