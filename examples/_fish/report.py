"""The summary, pictures and the movie."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms
from magshell.envs.fish import TIME_STEP, TORQUES

from .search import Found

JOINTS = ("neck", "back", "tail", "right fin", "left fin")
COLORS = ("#20639b", "#3caea3", "#c8442d", "#e0a030", "#8a5fa0")
VIEW = (35, -70)


def summary(result: dict) -> str:
    found, motion = result["found"], result["motion"]
    mesh = found.fish.flesh.mesh
    way = np.array2string(found.fish.way(motion), precision=4)
    reached = f"episode {found.episodes}" if found.episodes else "not reached"
    lines = [
        f"{mesh.n_vertices} nodes, {mesh.n_tetrahedra} tetrahedra, {found.controls.size} unknowns",
        f"within 1 % of the target: {reached}; way {way} m; {found.seconds[-1]:.0f} s in all",
        f"a step {result['milliseconds']:.1f} ms of the processor, {motion.iterations / motion.steps_done:.1f} iterations",
        f"slope along the gradient over {result['slope_steps']} steps against differences: {result['slope']:.1e}",
        "episode   miss over the way   seconds",
    ]
    rows = enumerate(zip(found.misses, found.seconds, strict=True), start=1)
    return "\n".join(lines + [f"{k:7d}   {miss:17.4f}   {second:7.1f}" for k, (miss, second) in rows])


def draw_search(axes, found: Found) -> None:
    axes.semilogy(1 + np.arange(len(found.misses)), found.misses, "o-", ms=3, color=COLORS[0])
    axes.axhline(0.01, color="#999999", lw=0.8, ls=":")
    axes.set(xlabel="episode", ylabel="miss over the way")


def draw_torques(axes, found: Found) -> None:
    times = TIME_STEP * np.arange(len(found.controls))
    for name, color, most, row in zip(JOINTS, COLORS, TORQUES, found.controls.T, strict=True):
        axes.plot(times, most * row, color=color, lw=1, label=name)
    axes.set(xlabel="time [s]", ylabel="torque [N m]")
    axes.legend(frameon=False, fontsize=8, ncols=2)


def picture(motion: ms.Trajectory) -> ms.Picture:
    last = len(motion) - 1
    return ms.plot(motion, states=[0, last // 3, 2 * last // 3, last], color=None, view=VIEW)


def movie(motion: ms.Trajectory, path: Path, **options) -> Path:
    return ms.animate(motion, path, color=None, view=VIEW, **options)
