"""The figure of examples/octopus.py, its movies, and the summary that is printed."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

FOUND, SWING, SIDE = "#20639b", "#c8442d", "#3d9970"
HEAD, TENTACLE, WATER, WALL = "#e8a87c", "#b5485d", "#9cc9e0", "#8a8f98"
COLORS = {"swing": SWING, "found": FOUND}
LABELS = {"swing": "even swing", "found": "found"}
EYE = np.radians(20.0)  # by which the eye is turned about the channel's axis: the outline of a tube stays
LIGHT = np.array([0.45, -0.7, 0.55])  # along the channel, from the eye to the sheet, up
BEGIN = -34  # mm, of the pictures
PAPER = {"pipe I": (72, 3.6e4), "pipe II": (41, 2.2e4), "tunnel": (49, 4.4e4)}  # [Chen22] Table 1, six cores


def draw_swimmer(axes, result: dict, positions: np.ndarray) -> None:
    """Draw the octopus at positions (n_v, 3) m in its channel, seen across the axis through the translucent wall."""
    turned = positions @ np.array([[1, 0, 0], [0, np.cos(EYE), np.sin(EYE)], [0, -np.sin(EYE), np.cos(EYE)]])
    corners = turned[result["body"].mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shade = 0.45 + 0.55 * np.abs(normals @ LIGHT) / np.linalg.norm(LIGHT)
    tentacle = result["body"].tentacle[:, None] >= 0
    colors = shade[:, None] * np.where(tentacle, to_rgb(TENTACLE), to_rgb(HEAD))
    from_the_back = np.argsort(-corners[:, :, 1].mean(axis=1))
    faces = 1e3 * corners[from_the_back][:, :, [0, 2]]
    axes.add_collection(
        PolyCollection(faces, facecolors=colors[from_the_back], edgecolors=colors[from_the_back], lw=0.3)
    )
    x, radius = 1e3 * result["outline"]
    axes.fill_between(x, -radius, radius, color=WATER, alpha=0.3, lw=0, zorder=3)
    top = 1.35 * radius.max()
    for side in (-1, 1):
        axes.fill_between(x, side * radius, side * top, color=WALL, lw=0, zorder=4)
    axes.axvline(1e3 * result["channel"].end, color="k", lw=0.8, ls=":", zorder=5)
    axes.set(xlim=(BEGIN, x[-1]), ylim=(-top, top), aspect="equal")
    axes.set_axis_off()


def draw_snapshot(axes, result: dict, time: float) -> None:
    motion = result["found"]
    frame = int(np.argmin(np.abs(result["times"] - time)))
    draw_swimmer(axes, result, motion["positions"][frame])
    axes.plot(
        1e3 * motion["center"][: frame + 1, 0],
        1e3 * motion["center"][: frame + 1, 2],
        color="k",
        lw=0.8,
        zorder=6,
    )
    axes.text(BEGIN + 2, -25, f"{time:.2f} s", zorder=6, color="w", va="center", fontsize=8)


def draw_path(axes, result: dict) -> None:
    """Draw the position along the channel: center of mass and requested path, last tip and end of the channel."""
    for name in COLORS:
        motion = result[name]
        axes.plot(
            result["times"],
            1e3 * motion["center"][:, 0],
            color=COLORS[name],
            lw=1.6,
            label=f"center, {LABELS[name]}",
        )
        axes.plot(
            result["times"], 1e3 * motion["tail"], color=COLORS[name], lw=0.9, ls="--", label="last tip"
        )
    axes.plot(result["times"], 1e3 * result["path"], color="k", lw=0.8, label="asked for")
    axes.axhline(1e3 * result["channel"].end, color="k", lw=0.8, ls=":")
    axes.set(xlabel="time [s]", ylabel="x [mm]", xlim=(0, result["times"][-1]))
    axes.legend(frameon=False, fontsize=7)


def draw_field(axes, result: dict) -> None:
    times = result["times"][1:]
    axes.plot(times, 1e3 * result["swing"]["field"][:, 0], color=SWING, lw=0.7, label="$B_x$, even swing")
    for name, color, k in (("y", SIDE, 1), ("z", "#b07aa1", 2), ("x", FOUND, 0)):
        axes.plot(times, 1e3 * result["found"]["field"][:, k], color=color, lw=1.0, label=f"$B_{name}$")
    axes.set(xlabel="time [s]", ylabel="B [mT]", xlim=(0, times[-1]))
    axes.legend(frameon=False, fontsize=7, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))


def draw_search(axes, result: dict) -> None:
    """Draw the objective at the start and end of every horizon's search, against the time at which the horizon
    begins.
    """
    for part, found in result["search"].searches:
        first, last = found.history[0].objective, found.objective
        begin = result["times"][part.first]
        axes.plot([begin, begin], [1e6 * first, 1e6 * last], "-", color=FOUND, lw=1.0)
        axes.plot(begin, 1e6 * first, "o", color=SWING, ms=3)
        axes.plot(begin, 1e6 * last, "o", color=FOUND, ms=3)
    axes.set_yscale("log")
    axes.set(xlabel="time at which a horizon begins [s]", ylabel="objective [mm$^2$]")


def movie(result: dict, path, fps: int = 25, slower: float = 2.0) -> None:
    """Write the movie of the motion found, in slow motion, with the field's component along the channel."""
    from matplotlib import pyplot as plt
    from matplotlib.animation import PillowWriter

    figure, axes = plt.subplots(figsize=(6, 3.2))
    writer, times, motion = PillowWriter(fps=fps), result["times"], result["found"]
    with writer.saving(figure, str(path), dpi=80):
        last = times[-1] if motion["passed"] is None else motion["passed"] + 0.1
        for time in np.arange(0.0, last, 1 / (fps * slower)):
            axes.clear()
            frame = int(np.argmin(np.abs(times - time)))
            draw_swimmer(axes, result, motion["positions"][frame])
            along = 1e3 * motion["field"][max(frame - 1, 0), 0]
            tail, tip = (BEGIN + 40, -25), (BEGIN + 40 + along, -25)
            if abs(along) > 1.0:
                axes.annotate(
                    "", tip, tail, arrowprops={"color": "w", "width": 1.5, "headwidth": 6}, zorder=7
                )
            axes.set_title(f"{result['channel'].name}: {time:.2f} s, $B_x$ = {along:.1f} mT", fontsize=10)
            writer.grab_frame()
    plt.close(figure)


def summary(results: dict[str, dict]) -> str:
    """Return the summary of every channel: passing times, cost of the search, and the paper's figures."""
    return "\n".join(_about(name, result) for name, result in results.items())


def _about(name: str, result: dict) -> str:
    steps, search = len(result["times"]) - 1, result["search"]
    end = 1e3 * result["channel"].end
    with_gradient = sum(
        found.history[-1].evaluations * (part.end - part.first) for part, found in search.searches
    )
    forward = 1e3 * result["found"]["processor_time"] / steps
    theirs, seconds = PAPER[name]
    return "\n".join(
        (
            f"{name}: {steps} steps, {search.controls.numel()} unknowns; passed when all is beyond {end:.0f} mm",
            *(_about_motion(LABELS[which], result[which]) for which in COLORS),
            f"  searched for {search.reached} steps: {search.trials} controls tried, {len(search.searches)} searches with "
            f"{search.evaluations} gradients over {with_gradient} steps in all",
            f"  {result['processor_time']:.0f} s of processor time; a motion {forward:.2f} ms a step without gradient",
            f"  [Chen22] Table 1: {theirs} iterations, {seconds / theirs:.0f} s each on six cores",
        )
    )


def _about_motion(label: str, motion: dict) -> str:
    passed = "does not pass" if motion["passed"] is None else f"passes after {motion['passed']:.2f} s"
    return (
        f"  {label:<20} {passed}; center at {1e3 * motion['center'][-1, 0]:.1f} mm in the end, last tip at "
        f"{1e3 * motion['tail'][-1]:.1f} mm; field {1e3 * motion['rms']:.1f} mT rms, at most "
        f"{1e3 * motion['strongest']:.1f} mT; {motion['halved']} steps in parts"
    )
