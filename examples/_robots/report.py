"""The summary, the curves of the search, pictures and the movie."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms

from .search import REACHED, Found

COLORS = ("#20639b", "#3caea3", "#c8442d", "#e0a030", "#8a5fa0")


def label(found: Found) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in found.start.items()) or "as chosen"


def summary(result: dict, meshes) -> str:
    found, motion = result["found"], result["motion"]
    first = found[0]
    nodes, tetrahedra = (
        sum(getattr(each, name) for each in meshes) for name in ("n_vertices", "n_tetrahedra")
    )
    moved = np.array2string(first.robot.displacement(motion), precision=4)
    halved = f", {len(motion.substeps)} of them in parts" if motion.substeps else ""
    lines = [
        f"{nodes} nodes, {tetrahedra} tetrahedra, {first.controls.size} unknowns; displacement {moved} m",
        f"a step {result['forward']:.1f} ms of the processor, backwards {result['backward']:.1f}; "
        f"{motion.iterations / motion.steps_done:.1f} iterations{halved}",
        f"slope along the gradient over {result['slope_steps']} steps against differences: {result['slope']:.1e}, "
        f"at what was found {result['slope_found']:.1e}",
        "start: episodes to 1 % of the distance, seconds, least distance over the initial one",
        *(
            f"  {label(each)}: {each.episodes or f'not in {len(each.distances)}'}, {each.seconds[-1]:.0f} s, "
            f"{each.distances.min():.4f}"
            for each in found
        ),
        "episode   relative distance   seconds",
    ]
    rows = enumerate(zip(first.distances, first.seconds, strict=True), start=1)
    return "\n".join(lines + [f"{k:7d}   {distance:17.4f}   {second:7.1f}" for k, (distance, second) in rows])


def draw_search(by_episode, by_time, found: list[Found]) -> None:
    for each, color in zip(found, COLORS, strict=False):
        by_episode.semilogy(
            1 + np.arange(len(each.distances)), each.distances, "o-", ms=3, color=color, label=label(each)
        )
        by_time.semilogy(each.seconds, each.distances, "o-", ms=3, color=color)
    for axes, name in ((by_episode, "episode"), (by_time, "time [s]")):
        axes.axhline(REACHED, color="#999999", lw=0.8, ls=":")
        axes.set(xlabel=name, ylabel="distance over the initial one")
    if len(found) > 1:
        by_episode.legend(frameon=False, fontsize=7)


def picture(motion: ms.Trajectory, view, **options) -> ms.Picture:
    last = len(motion) - 1
    return ms.plot(
        motion, states=[0, last // 3, 2 * last // 3, last], view=view, **{"color": None, **options}
    )


def movie(motion: ms.Trajectory, path: Path, view, **options) -> Path:
    return ms.animate(motion, path, view=view, **{"color": None, **options})
