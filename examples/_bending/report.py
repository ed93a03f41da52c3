"""The figure, and the summary that is printed."""

from __future__ import annotations

import numpy as np

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"


def draw_alignment(axes, states) -> None:
    fields = [1e3 * state["field"] for state in states]
    axes.axhline(-np.sqrt(0.5), color=GREY, lw=1, ls=":")
    axes.text(fields[-1], -0.69, "flat", color=GREY, ha="right")
    axes.plot(fields, [state["alignment_at_rest"] for state in states], "o-", color=BLUE, label="at rest")
    reached = [state["alignment"] for state in states]
    axes.plot(fields, reached, "o", mfc="white", color=RED, label="at the motion's end")
    axes.set(xlabel="flux density along [1, 0, -1] [mT]", ylabel="cosine of magnet and field", xscale="log")
    axes.set_xticks(fields, [f"{field:g}" for field in fields])
    axes.minorticks_off()
    axes.set_ylim(-0.8, 1.08)
    axes.legend(frameon=False, loc="center right")


def draw_turning(axes, twisted: dict, turning: float, rotations: int) -> None:
    times = twisted["motion"].times
    axes.plot(times, twisted["alignment"], color=BLUE)
    axes.axvline(turning, color=GREY, lw=1, ls=":")
    axes.text(turning, 0.02, f"  {rotations} turns done", color=GREY)
    axes.plot(times, twisted["end"][:, 0] / twisted["end"][0, 0], color=RED)
    axes.text(times[-1], 0.22, "cosine of magnet and field", color=BLUE, ha="right")
    axes.text(times[-1], 0.12, "x of the end / length", color=RED, ha="right")
    axes.set(xlabel="time [s]", ylim=(0, 1.05))


def draw_balance(axes, twisted: dict) -> None:
    times, balance = twisted["motion"].times, twisted["balance"]
    axes.plot(times, 1e6 * balance.received, color=BLUE, label="put in by the changing field")
    axes.plot(times, 1e6 * balance.lost, color=RED, label="lost to damping")
    axes.plot(times, 1e6 * balance.gained, color="black", label="gained by the strip")
    rest = balance.received - balance.lost
    axes.plot(times, 1e6 * rest, color="#f0c419", ls=(0, (4, 4)), label="put in less lost")
    axes.set(xlabel="time [s]", ylabel="energy [µJ]")
    axes.legend(frameon=False, fontsize=8, loc=(0.52, 0.3))


def draw_undamped(axes, runs) -> None:
    for run, color in zip(runs, (RED, "#f0a419", BLUE), strict=True):
        axes.plot(run["times"], 100 * run["lost"], color=color, label=f"step {1e3 * run['time_step']:g} ms")
    axes.set(xlabel="time [s]", ylabel="lost without damping [%]", ylim=(0, None))
    axes.legend(frameon=False)


def summary(result: dict) -> str:
    """Return the summary: alignment in bending, the twisting, and the energy lost without damping."""
    return "\n\n".join((bending(result["bent"]), twisting(result["twisted"]), conserved(result["undamped"])))


def bending(states) -> str:
    lines = ["Bent along [1, 0, -1]   cosine at rest   at the motion's end, from rest [mm]   energy's gap"]
    lines += [
        f"  {1e3 * state['field']:8.1f} mT {state['alignment_at_rest']:23.4f} {state['alignment']:20.4f} "
        f"{1e3 * state['distance_to_rest']:16.3f} {state['balance'].error:16.1e}"
        for state in states
    ]
    return "\n".join(lines)


def twisting(twisted: dict) -> str:
    motion, balance, alignment = twisted["motion"], twisted["balance"], twisted["alignment"]
    lowest = alignment.argmin()
    milliseconds = 1e3 * motion.wall_time / motion.steps
    return f"""Twisted by a field that turns twice
  least cosine of magnet and field     {alignment[lowest]:.4f}, at {motion.times[lowest]:.2f} s
  end's x at the least                 {1e3 * twisted["end"][:, 0].min():.1f} mm
  from flat at {motion.times[-1]:.1f} s                 {1e3 * twisted["left_over"]:.2f} mm
  put in by the field, lost            {1e6 * balance.received[-1]:.1f} and {1e6 * balance.lost[-1]:.1f} µJ
  energy's gap                         {balance.error:.1e} of what is turned over
  a step                               {milliseconds:.0f} ms"""


def conserved(runs) -> str:
    lines = ["Without damping, lost of the magnetic energy's range"]
    lines += [f"  step of {1e3 * run['time_step']:4.1f} ms {100 * run['lost'][-1]:10.3f} %" for run in runs]
    return "\n".join(lines)
