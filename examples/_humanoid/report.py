"""The table, pictures and the movie."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms

from .fall import TIME_STEP, Fall, angles

COLORS = {"no skeleton": "#8a8a8a", "rigid": "#e0a030", "passive": "#20639b", "driven": "#c8442d"}
PAPER = {  # [Qiao21] Figure 1: bone length, body length, joint angles, ms a step
    "no skeleton": ("0.13 +- 0.02", "0.20 +- 0.14", "2.45 +- 0.87", "132"),
    "rigid": ("0", "0.07", "1.81", "727"),
    "passive": ("0", "0.04 +- 0.03", "2.34 +- 0.78", "163"),
    "driven": ("0", "0.05 +- 0.03", "0.41 +- 0.30", "191"),
}
MEASURES = ("bone_error", "body_error", "joint_error", "milliseconds")
VIEW = (10, -80)


def table(falls: dict[str, list[Fall]]) -> dict[str, dict[str, tuple[float, float]]]:
    """Return the means and standard deviations over the starts, {kind: {measure: (mean, standard deviation)}}."""
    return {
        kind: {
            name: (float(np.mean(values)), float(np.std(values)))
            for name in MEASURES
            for values in [[getattr(each, name) for each in rows]]
        }
        for kind, rows in falls.items()
    }


def summary(result: dict) -> str:
    mesh = result["body"].mesh
    lines = [
        f"{mesh.n_vertices} nodes, {mesh.n_tetrahedra} tetrahedra; means and standard deviations, theirs in brackets",
        f"{'':14s}{'bone length':>34s}{'body length':>34s}{'joint angles [rad]':>34s}{'a step [ms]':>24s}",
    ]
    for kind, row in table(result["falls"]).items():
        cells = [
            f"{mean:.2g} +- {spread:.1g} ({theirs})"
            for (mean, spread), theirs in zip(row.values(), PAPER[kind], strict=True)
        ]
        lines.append(f"{kind:14s}{cells[0]:>34s}{cells[1]:>34s}{cells[2]:>34s}{cells[3]:>24s}")
    if result["slope"] is not None:
        lines.append(f"slope along the gradient by torque limits against differences: {result['slope']:.1e}")
    return "\n".join(lines)


def draw_angles(axes, result: dict) -> None:
    """Draw the angle of the right shoulder over time for every start."""
    body = result["body"]
    for kind, rows in result["falls"].items():
        for k, each in enumerate(rows):
            turned = [angles(body, positions)[0] for positions in each.motion.positions[::2]]
            label = kind if k == 0 else None
            axes.plot(each.motion.times[::2], turned, color=COLORS[kind], lw=1, label=label)
    axes.axhline(0.8, color="#999999", lw=0.8, ls=":")
    axes.set(xlabel="time [s]", ylabel="right shoulder [rad]")
    axes.legend(frameon=False, fontsize=8)


def draw_errors(axes, result: dict) -> None:
    """Draw the errors of the joint angles by kind of skeleton."""
    rows = table(result["falls"])
    for k, kind in enumerate(rows):
        mean, spread = rows[kind]["joint_error"]
        axes.bar(k, mean, yerr=spread, color=COLORS[kind], width=0.6)
    axes.set_xticks(range(len(rows)), list(rows), fontsize=8)
    axes.set(ylabel="error of joint angles [rad]")


def picture(fall: Fall) -> ms.Picture:
    last = len(fall.motion) - 1
    return ms.plot(fall.motion, states=[0, last // 4, last // 2, last], color=None, view=VIEW)


def movie(fall: Fall, path: Path, **options) -> Path:
    duration = TIME_STEP * (len(fall.motion) - 1)
    return ms.animate(fall.motion, path, speed=duration / 5, color=None, view=VIEW, **options)
