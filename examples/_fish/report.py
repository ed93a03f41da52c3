"""The figure of the torques that were found, and the view of the fish."""

from __future__ import annotations

import numpy as np
from _robots.report import COLORS
from _robots.search import Found
from robots.fish import TIME_STEP, TORQUES

JOINTS = ("neck", "back", "tail", "right fin", "left fin")
VIEW = (35, -70)


def draw_torques(axes, found: Found) -> None:
    times = TIME_STEP * np.arange(len(found.controls))
    for name, color, most, row in zip(JOINTS, COLORS, TORQUES, found.controls.T, strict=True):
        axes.plot(times, most * row, color=color, lw=1, label=name)
    axes.set(xlabel="time [s]", ylabel="torque [N m]")
    axes.legend(frameon=False, fontsize=8, ncols=2)
