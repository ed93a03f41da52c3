"""A strip that a field has folded stays folded by its own field; without that it opens again.

The strip is magnetized along itself. Its left leaf is glued to a table, a thin crease joins the right one, which is free.
A field of 30 mT turns from along the strip to 170 degrees and takes the free leaf with it, gets weaker there, and ends.
Then a field straight up tries to lift the leaf.

What comes out, each state from the one before:

                           angle of the leaf at 170 degrees    without a field    opens in a field of
    with its own field              171 degrees                     180                8 mT
    without                         170                               0                -

- Folded, the magnetic charges at the ends of both leaves have opposite signs, 0.6 mm apart: that is what a soft coat
  leaves between the middle surfaces. They close the strip while the field gets weaker, and hold it then.
- The crease alone opens the strip as the field ends.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _own_field.field_lines import draw_field_lines
from _own_field.leaves import LAST_ANGLE, WIDTH, folding_strip, program
from _run import run

import magshell as ms

NAMES = {True: "with its own field", False: "without"}
BOX = (-8e-3, 47e-3, -10e-3, 28e-3)  # m, of the pictures of field lines


def main(cells=26, opening=8) -> dict:
    """Return the angles of the leaf with and without the own field, in SI units but for degrees.

    opening: number of fields straight up, 2 mT apart.
    """
    return {own: measured(folding_strip(cells, own), program(opening)) for own in (True, False)}


def measured(strip, fields: list[tuple[float, float]]) -> dict:
    states = strip.states(fields)
    angles = np.array([strip.angle(state) for state in states])
    strengths, directions = np.array(fields).T
    ended = int(np.argmax(strengths == 0.0))
    at_end = int(np.argmax(directions == LAST_ANGLE))
    lifted = (angles[ended] > 90.0) & (angles[ended + 1 :] < 150.0)
    return {
        "strip": strip,
        "states": states,
        "strengths": strengths,
        "directions": directions,
        "angles": angles,
        "ended": ended,
        "at_end": at_end,
        "folded_in_field": angles[at_end],
        "without_field": angles[ended],
        "opens_at": float(strengths[ended + 1 :][np.argmax(lifted)]) if lifted.any() else np.nan,
        "energies": ms.field_of(states[ended]).energies,
    }


def plot(result: dict):
    """Draw the field lines where the field has turned, where it has ended, and where it lifts the leaf."""
    from matplotlib import pyplot as plt

    figure, rows = plt.subplots(2, 3, figsize=(12, 6.4), layout="constrained", sharex=True, sharey=True)
    for row, own in zip(rows, (True, False), strict=True):
        one = result[own]
        shown = {
            "30 mT at 170 degrees": one["at_end"],
            "no field": one["ended"],
            f"{1e3 * one['strengths'][-1]:.0f} mT upwards": len(one["states"]) - 1,
        }
        for axes, (title, number) in zip(row, shown.items(), strict=True):
            draw_field_lines(axes, one["states"][number], WIDTH / 2, BOX)
            axes.set_title(f"{NAMES[own]}: {title}", loc="left", fontsize=10)
        row[0].set_ylabel("z [mm]")
    return figure


def summary(result: dict) -> str:
    lines = ["A strip of two leaves"]
    for name, one in result.items():
        end = "does not hold" if np.isnan(one["opens_at"]) else f"opens at {1e3 * one['opens_at']:.0f} mT"
        lines.append(
            f"  {NAMES[name]}: {one['folded_in_field']:.0f} degrees in the field, {one['without_field']:.0f} without; "
            f"{end}; {sum(state.iterations for state in one['states'])} iterations"
        )
    return "\n".join(lines)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "self_folding.png", dpi=160)


if __name__ == "__main__":
    run(main, summary, write)
