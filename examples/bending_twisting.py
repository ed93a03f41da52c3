"""A strip whose free end is a magnet, bent by five fields and twisted by one that turns: [Chen22] Figure 2.

The strip of 2048 faces is clamped at its left end; its right quarter is magnetized along its normal. Fields
along [1, -1, 0] of the paper, whose second axis is the vertical one, [1, 0, -1] here, bend the end over by up
to 135 degrees. A field that turns twice about the long axis twists it.

What comes out:

- The stronger the field, the better the magnet is aligned: flat the cosine is -0.71, at rest in 0.2 mT -0.21,
  in 1 mT 0.81, in 5 mT 0.987.
- In 50 mT the strip follows both turns, its end 5 % nearer for them and the cosine never below 0.94, and
  stays twisted by 720 degrees, for 0.3 s. But straight it is unstable: round-off has grown meanwhile, it
  throws a loop, the loop passes over the end, no twist is left, and the strip creeps back to flat. Two turns
  can be undone while both ends keep their directions, as with a belt. An imperfect strip would do so sooner.
- Energy adds up. What kinetic, elastic and magnetic energy gain is what the changing field puts in, - m . dB,
  less what damping takes: the gap is at most 0.1 % of what is turned over, at the paper's step of 10 ms, in
  bending and in the twisting, loop and all.
- In a constant field without damping nothing should be lost. TR-BDF2 loses 0.5, 0.2 and 0.08 % of what the
  magnetic energy exchanges in 2 s, in steps of 10, 5 and 2.5 ms, after 0.2 mT have come at once. After
  stronger fields it loses more (3 mT: 38, 27 and 17 %), in waves that are too fast for the step.

Material, thickness, damping, step and mesh are those of Table 1 (64 x 8 cells of four triangles have its 2048
faces and 1097 vertices); only the slow bending goes in steps of 0.1 s. The strip's size, its magnet and the
fields' strengths are not printed, nor whether gravity acts; there is none here. With the table's 1e-4 N s/m
at each vertex so small a strip is overdamped: in the weakest field it is 5 mm from rest after a minute.

Run it: prints a summary and writes pictures and a movie into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _bending.report import draw_alignment, draw_balance, draw_turning, draw_undamped, summary
from _bending.strip import CELLS, TIME_STEP, Strip, balance, strip
from _run import run

import magshell as ms

FIELDS = np.array([0.2e-3, 0.5e-3, 1e-3, 2e-3, 5e-3])  # T
DIRECTION = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)
RISE, BENDING_STEP = 2.0, 0.1  # s; the first: how long the fields grow
TURNING_FIELD, TURNS, TURNING = 50e-3, 2, 2.0  # T, 1, s
SUDDEN_FIELD, SUDDEN_STEPS = 0.2e-3, (1e-2, 5e-3, 2.5e-3)  # T, s


def main(cells=CELLS, bending_time=60.0, turning_time=6.0, undamped_time=2.0) -> dict:
    """Return the figure's numbers, in SI units."""
    sheet = strip(cells)
    return {
        "strip": sheet,
        "bent": [bent(sheet, field, bending_time) for field in FIELDS],
        "twisted": twisted(sheet, turning_time),
        "undamped": [undamped(sheet, step, undamped_time) for step in SUDDEN_STEPS],
    }


def bent(sheet: Strip, strength: float, duration: float) -> dict:
    """Simulate the strip while a field grows to its strength [T] and stays, and find its equilibrium there."""

    def field(time):
        return strength * min(time / RISE, 1.0) * DIRECTION

    motion = sheet.simulate(field, duration, time_step=BENDING_STEP)
    rest = ms.equilibrium(
        sheet.scene,
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=strength * DIRECTION,
        start=motion.positions[-1],
    )
    return {
        "field": strength,
        "alignment": sheet.alignment(motion.positions[-1:], DIRECTION)[0],
        "alignment_at_rest": sheet.alignment(rest.positions[None], DIRECTION)[0],
        "distance_to_rest": np.abs(motion.positions[-1] - rest.positions).max(),
        "balance": balance(sheet, motion, np.array([field(time) for time in motion.times])),
        "positions": rest.positions,
    }


def turning(time: float) -> np.ndarray:
    """Return the field [T] that starts along +z and rotates about the strip's long axis."""
    angle = 2 * np.pi * TURNS * min(time / TURNING, 1.0)
    return TURNING_FIELD * np.array([0.0, np.sin(angle), np.cos(angle)])


def twisted(sheet: Strip, duration: float) -> dict:
    """Simulate the strip in the rotating field, which is constant from `TURNING` on."""
    motion = sheet.simulate(turning, duration)
    fields = np.array([turning(time) for time in motion.times])
    middle = sheet.mesh.nearest_vertex((sheet.mesh.rest_positions[:, 0].max(), 0.0, 0.0))
    return {
        "motion": motion,
        "fields": fields,
        "alignment": sheet.alignment(motion.positions, fields),
        "end": motion.positions[:, middle],
        "balance": balance(sheet, motion, fields),
        "left_over": np.abs(motion.positions[-1] - sheet.mesh.rest_positions).max(),
    }


def undamped(sheet: Strip, time_step: float, duration: float) -> dict:
    """Simulate a suddenly applied constant field without damping, and return the energy lost.

    It is given over the range of the magnetic energy.
    """
    motion = sheet.simulate(SUDDEN_FIELD * DIRECTION, duration, time_step=time_step, damping=0.0)
    exchanged = np.ptp(motion.energies["magnetic"])
    return {
        "time_step": time_step,
        "times": motion.times,
        "lost": (motion.energy[0] - motion.energy) / exchanged,
        "kinetic": motion.kinetic_energy.max() / exchanged,
    }


def plot(result: dict):
    """Draw the alignment against the field, the twisting, its energies, and the loss of TR-BDF2."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 2, figsize=(9, 6.2), layout="constrained")
    draw_alignment(axes[0, 0], result["bent"])
    draw_turning(axes[0, 1], result["twisted"], TURNING, TURNS)
    draw_balance(axes[1, 0], result["twisted"])
    draw_undamped(axes[1, 1], result["undamped"])
    for panel, letter in zip(axes.flat, "abcd", strict=True):
        panel.set_title(letter, loc="left", fontweight="bold")
        panel.spines[["top", "right"]].set_visible(False)
    return figure


def bent_picture(result: dict) -> ms.Picture:
    """Draw the five bent states, coloured by magnetic energy."""
    sheet, states = result["strip"], result["bent"]
    return ms.plot(
        sheet.mesh,
        positions=np.stack([state["positions"] for state in states]),
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=[state["field"] * DIRECTION for state in states],
        color="magnetic_energy",
        titles=[f"{1e3 * state['field']:g} mT" for state in states],
        view=(10, -40),
        columns=3,
        width=2000,
        style=ms.Style(arrows=12),
    )


def twisted_picture(result: dict, moments=(0.0, 0.5, 1.0, 1.5, 2.0, 2.2, 2.5, 3.0, 6.0)) -> ms.Picture:
    """Draw the strip at these times [s], coloured by magnetic energy."""
    sheet, motion, fields = result["strip"], result["twisted"]["motion"], result["twisted"]["fields"]
    shown = np.searchsorted(motion.times, np.minimum(moments, motion.times[-1]) - TIME_STEP / 2)
    return ms.plot(
        sheet.mesh,
        positions=motion.positions[shown],
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=fields[shown],
        color="magnetic_energy",
        titles=[f"{time:.1f} s, {360 * TURNS * min(time / TURNING, 1):.0f}°" for time in motion.times[shown]],
        view=(22, -60),
        columns=3,
        style=ms.Style(arrows=20),
    )


def movie(result: dict, path, every=4, fps=25) -> Path:
    """Write the movie of the twisting, and of its end."""
    sheet, motion, fields = result["strip"], result["twisted"]["motion"], result["twisted"]["fields"]
    return ms.animate(
        sheet.mesh,
        path,
        positions=motion.positions[::every],
        times=motion.times[::every],
        remanent_magnetization=sheet.remanent_magnetization,
        applied_flux_density=fields[::every],
        color="magnetic_energy",
        view=(22, -60),
        width=800,
        fps=fps,
        progress=False,
    )


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "bending_twisting.png", dpi=200)
    bent_picture(outcome).save(out / "bending.png")
    twisted_picture(outcome).save(out / "twisting.png")
    movie(outcome, out / "twisting.gif")


if __name__ == "__main__":
    run(main, summary, write)
