"""The figure of the motions, and the summary that is printed."""

from __future__ import annotations

import numpy as np

from .model import NO_SNAP, RAMP
from .motion import SNAPPED, Ringing

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"


def draw_ramp(axes, result: dict) -> None:
    _measured(axes, result["measured"]["ramp"])
    _computed(axes, result["ramp"]["motion"])
    axes.set(xlabel="time [s], the field grows by 6.5 mT/s", ylabel="mid-span displacement [mm]")
    axes.legend(frameon=False, loc="lower right")


def draw_snap(axes, result: dict) -> None:
    _measured(axes, result["measured"]["ramp"])
    _computed(axes, result["ramp"]["motion"])
    limit = result["limit"] / RAMP
    axes.axvline(limit, color=GREY, lw=1, ls=":")
    axes.text(
        limit, 9.3, f"limit of statics \n{1e3 * result['limit']:.2f} mT ", color=GREY, va="top", ha="right"
    )
    axes.set(xlabel="time [s]", ylabel="mid-span displacement [mm]", xlim=(0.65, 1.3), ylim=(0, 9.8))


def draw_step(axes, result: dict) -> None:
    _measured(axes, result["measured"]["step"])
    _computed(axes, result["step"]["motion"])
    other = result["other_mounting"]
    motion = other["motion"]
    axes.plot(
        motion.times,
        1e3 * motion.displacements,
        color=GREY,
        lw=1,
        label=f"computed, shortening {1e3 * other['shortening']:.2f} mm",
    )
    axes.set(
        xlabel=f"time since {1e3 * NO_SNAP:g} mT were switched on [s]",
        ylabel="mid-span displacement [mm]",
        ylim=(-0.1, 2.9),
    )
    axes.legend(frameon=False, loc="upper right")


def draw_pluck(axes, result: dict) -> None:
    for name, color in (("elastic", GREY), ("viscous", BLUE)):
        motion, ringing = (result["pluck"][name][key] for key in ("motion", "ringing"))
        label = f"{'with' if name == 'viscous' else 'without'} the branch, {ringing.frequency:.1f} Hz"
        axes.plot(motion.times, 1e6 * motion.displacements, color=color, label=label)
    axes.set(
        xlabel="time since 0.5 mT were switched off [s]", ylabel="mid-span displacement [µm]", ylim=(-80, 115)
    )
    axes.legend(frameon=False, loc="upper right")


def _measured(axes, curve: dict) -> None:
    axes.plot(curve["times"], 1e3 * curve["displacements"], "o", ms=4, mfc="white", mec=RED, label="measured")


def _computed(axes, motion) -> None:
    axes.plot(motion.times, 1e3 * motion.displacements, color=BLUE, label="computed")


def summary(result: dict) -> str:
    """Return the summary: ramp, step, pluck and variations, computed and measured."""
    sections = (ramp, steps, pluck, varied)
    return "\n\n".join(section(result) for section in sections)


def ramp(result: dict) -> str:
    ours, theirs, limit = result["ramp"], result["measured_ramp"], result["limit"]
    columns, rows = result["cells"]
    motion = ours["motion"].trajectory
    lines = [f"Ramp of 6.5 mT/s, {columns} x {rows} cells       computed   measured"]
    for what, key, factor, decimals in (
        (f"passes {1e3 * SNAPPED:g} mm at [s]", "snap", 1, 4),
        ("the field then [mT]", "field", 1e3, 3),
        ("overshoots to [mm]", "peak", 1e3, 2),
        ("falls back to [mm]", "dip", 1e3, 2),
    ):
        lines.append(
            f"  {what:<36} {factor * ours[key]:8.{decimals}f}   {factor * theirs[key]:8.{decimals}f}"
        )
    plateau = {name: 1e3 * value for name, value in result["plateau"].items()}
    lines.append(
        f"  {'plateau, mean above 10 mT [mm]':<36} {plateau['computed']:8.2f}   {plateau['measured']:8.2f}"
    )
    delays = (ours["snap"] - limit / RAMP, theirs["snap"] - limit / RAMP)
    lines.append(f"  {'after the limit of statics by [s]':<36} {delays[0]:8.4f}   {delays[1]:8.4f}")
    lines.append(f"  {'limit of statics on this mesh [mT]':<36} {1e3 * limit:8.3f}")
    lines.append(f"  {'a step [ms of wall time]':<36} {1e3 * motion.wall_time / motion.steps:8.1f}")
    return "\n".join(lines)


def steps(result: dict) -> str:
    ours, theirs, other = result["step"], result["measured_step"], result["other_mounting"]
    names = ("computed", "measured", f"computed, shortening {1e3 * other['shortening']:.2f} mm")
    lines = [f"Step to {1e3 * NO_SNAP:g} mT{'':<26}" + "   ".join(names)]
    for what, value in (
        ("first peak [mm]", lambda case: 1e3 * case["peak"]),
        ("mean of the last third [mm]", lambda case: 1e3 * case["last_third"]),
        ("rings at [Hz]", lambda case: case["ringing"].frequency),
        ("its amplitude decays by [1/s]", lambda case: case["ringing"].decay),
    ):
        lines.append(f"  {what:<34}" + "   ".join(f"{value(case):8.2f}" for case in (ours, theirs, other)))
    snapped = ours["motion"].snap
    lines.append(f"  snaps: {'no' if snapped is None else f'at {snapped:.3f} s'}")
    lines.append(f"  with the other shortening the ramp snaps at {1e3 * other['ramp_field']:.1f} mT")
    return "\n".join(lines)


def pluck(result: dict) -> str:
    lines = ["About the buckled state"]
    for name, title in (("viscous", "with the Maxwell branch"), ("elastic", "without")):
        ringing: Ringing = result["pluck"][name]["ringing"]
        lines.append(f"  {title:<26}{ringing.frequency:6.2f} Hz, decays by {ringing.decay:5.2f} 1/s")
    lines.append(f"  {'vibration mode':<26}{result['frequency']:6.2f} Hz")
    lines.append(f"  {'references':<26}14.2 Hz for 1400 kPa, 16.5 Hz for 1900 kPa")
    return "\n".join(lines)


def varied(result: dict) -> str:
    given = result["variations"][0][1]
    lines = ["The ramp's snap, one thing changed at a time       [s]       later by"]
    for what, snap in result["variations"]:
        lines.append(f"  {what:<44}{snap:9.4f}{np.round(snap - given, 4):+11.4f}")
    return "\n".join(lines)
