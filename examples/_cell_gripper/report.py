"""The figure of the cells' volumes and of the paths of drone and ball, and the view of the gripper."""

from __future__ import annotations

from pathlib import Path

from _robots import report
from _robots.report import COLORS

import magshell as ms

VIEW = (108, -90)  # from above: y is up
LOOK = {"color": ms.Color("volume_ratio", label="volume over that at rest"), "obstacles": []}


def draw_controls(axes, result: dict) -> None:
    gripper, motion = result["found"][0].robot, result["motion"]
    values = gripper.values(result["found"][0].controls)
    times = motion.times
    axes.plot(times, values[gripper.drone]["displacement"][:, 1], color=COLORS[0], label="drone, up [m]")
    way = (motion[gripper.ball].displacements * gripper.weights[:, None]).sum(axis=1)
    axes.plot(times, way[:, 1], color=COLORS[2], label="ball, up [m]")
    volumes = values[gripper.cells]["volume_ratio"] - 1.0
    axes.plot(times[1:], volumes.mean(axis=1), color=COLORS[1], label="cells, more volume, mean and range")
    axes.fill_between(times[1:], volumes.min(axis=1), volumes.max(axis=1), color=COLORS[1], alpha=0.2, lw=0)
    axes.set(xlabel="time [s]")
    axes.legend(frameon=False, fontsize=7)


def picture(result: dict):
    return report.picture(result["motion"], VIEW, **LOOK)


def movie(result: dict, path: Path, **options) -> Path:
    shown = {"speed": 0.2, "fps": 25.0, "width": 500, **options}
    return report.movie(result["motion"], path, VIEW, **LOOK, **shown)
