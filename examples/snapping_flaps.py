"""Two magnetized flaps snap together by their own field, stay closed without a field, and let go in an opening one.

The flaps, 20 mm long and 8 mm apart, are clamped at their left ends and magnetized along themselves, the upper one to the
right and the lower one to the left. A field along z turns their free ends: one against z closes them, one along z opens
them. Their ends are magnetic charges of opposite sign, which attract each other: ms.OwnField computes that.

What comes out, each state from the one before:

                            without a field    closed at    closed without a field    opens at
    with their own field        7.40 mm         -0.50 mT             0.63 mm             2.25 mT
    without                     8.00            -1.50                8.00                   -

- With the own field there are two stable states without a field, 7.40 mm and 0.63 mm apart. Closed flaps, whose middle
  surfaces a soft coat keeps 0.6 mm apart, pull each other with 0.26 mN. 16 x 8 and 20 x 12 cells give 0.263 mN.
- Without it the opening depends on the present field alone: closed flaps open as the field that closed them ends.
- The pictures show the lines of the whole flux density, ms.field_of(state).flux_density, on the middle of the flaps.

Run it: prints a summary and writes a picture into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _own_field.field_lines import draw_field_lines
from _own_field.flaps import LENGTH, WIDTH, flaps
from _run import run

import magshell as ms

NAMES = {True: "with their own field", False: "without"}
BLUE, RED = "#20639b", "#c8442d"
BOX = (-5e-3, 30e-3, -20e-3, 20e-3)  # m, of the pictures of field lines


def main(cells=(12, 4), step=0.25e-3) -> dict:
    """Return the openings of both pairs of flaps in fields that close and open them, in SI units.

    step: of the field, T.
    """
    closing = np.arange(0.0, -2e-3 - 1e-9, -step)
    opening = np.arange(0.0, 5e-3 + 1e-9, step)
    fields = np.concatenate([closing, opening])
    return {own: measured(flaps(cells, own), fields, len(closing)) for own in (True, False)}


def measured(pair, fields: np.ndarray, end_of_closing: int) -> dict:
    """Return the states of one pair and their openings.

    end_of_closing: number of the state from which on the field opens.
    """
    states = pair.states(fields)
    openings = np.array([pair.opening(state) for state in states])
    closed = states[end_of_closing]
    holds = openings[end_of_closing] < 0.5 * openings[0]
    return {
        "pair": pair,
        "states": states,
        "fields": fields,
        "end_of_closing": end_of_closing,
        "openings": openings,
        "without_field": openings[0],
        "closed": openings[end_of_closing],
        "force": np.array([closed.magnetic_force(flap) for flap in pair.flaps]),
        "closes_at": _first(fields[:end_of_closing], openings[:end_of_closing] < 0.1 * openings[0]),
        "opens_at": _first(
            fields[end_of_closing:], holds & (openings[end_of_closing:] > 2 * openings[end_of_closing])
        ),
    }


def _first(fields: np.ndarray, there: np.ndarray) -> float:
    """Return the first of the fields where something holds, NaN if there is none."""
    return float(fields[np.argmax(there)]) if there.any() else np.nan


def plot(result: dict):
    """Draw the field lines of three states, and the openings over the field."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(11, 7), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=(1.3, 1))
    own = result[True]
    shown = {
        "no field: open": 0,
        "no field: they hold each other": own["end_of_closing"],
        f"{1e3 * own['fields'][-1]:.0f} mT upwards: released": len(own["states"]) - 1,
    }
    for column, (title, number) in enumerate(shown.items()):
        axes = figure.add_subplot(grid[0, column])
        draw_field_lines(axes, own["states"][number], WIDTH / 2, BOX)
        axes.set_title(title, loc="left")
        axes.set_ylabel("z [mm]" if column == 0 else "")
    axes = figure.add_subplot(grid[1, :])
    for name, color in ((True, BLUE), (False, RED)):
        one = result[name]
        for part, style in (
            (slice(0, one["end_of_closing"]), "o--"),
            (slice(one["end_of_closing"], None), "o-"),
        ):
            label = f"{NAMES[name]}, {'closing' if style == 'o--' else 'opening'}"
            axes.plot(
                1e3 * one["fields"][part], 1e3 * one["openings"][part], style, ms=3, color=color, label=label
            )
    axes.set(xlabel="field along z [mT]", ylabel="opening [mm]")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def summary(result: dict) -> str:
    lines = [f"Two flaps of {1e3 * LENGTH:.0f} mm"]
    for name, one in result.items():
        end = "does not hold" if np.isnan(one["opens_at"]) else f"opens at {1e3 * one['opens_at']:.2f} mT"
        lines.append(
            f"  {NAMES[name]}: {1e3 * one['without_field']:.2f} mm open without a field, closed at "
            f"{1e3 * one['closes_at']:.2f} mT, then {1e3 * one['closed']:.2f} mm without a field (force "
            f"{1e3 * one['force'][1, 2]:.3f} mN on the upper flap), {end}"
        )
    return "\n".join(lines)


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "snapping_flaps.png", dpi=160)


if __name__ == "__main__":
    run(main, summary, write)
