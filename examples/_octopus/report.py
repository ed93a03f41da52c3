"""The figure of examples/octopus.py, its movies, and the summary that is printed."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

FOUND, GUESS, GREY = "#20639b", "#c8442d", "#777777"
HEAD, TENTACLE, WATER, WALL = "#e8a87c", "#b5485d", "#9cc9e0", "#8a8f98"
COLORS = {"guess": GUESS, "found": FOUND}
LABELS = {"guess": "guess", "found": "found"}
EYE = np.radians(20.0)  # by which the eye is turned about the channel's axis: the outline of a tube stays
LIGHT = np.array([0.45, -0.7, 0.55])  # along the channel, from the eye to the sheet, up
BEGIN = -34  # mm, of the pictures
PAPER = {"pipe I": (72, 3.6e4), "pipe II": (41, 2.2e4), "tunnel": (49, 4.4e4)}  # [Chen22] Table 1, six cores


def draw_swimmer(axes, result: dict, positions: np.ndarray) -> None:
    """The octopus in its channel, (n_v, 3) m, seen across the axis through the translucent wall."""
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
    axes.set(xlim=(BEGIN, 1e3 * result["channel"].goal + 25), ylim=(-top, top), aspect="equal")
    axes.set_axis_off()


def draw_snapshot(axes, result: dict, name: str, time: float) -> None:
    motion = result[name]
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
    """Along the channel: the center of mass beside the sample points, and the last tip beside the channel's end."""
    for name in ("guess", "found"):
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
    axes.plot(
        result["sample_times"], 1e3 * result["samples"][:, 0], "o", color="k", ms=3.5, label="sample points"
    )
    axes.axhline(1e3 * result["channel"].end, color="k", lw=0.8, ls=":")
    axes.set(xlabel="time [s]", ylabel="x [mm]", xlim=(0, result["times"][-1]))
    axes.legend(frameon=False, fontsize=7)


def draw_field(axes, result: dict) -> None:
    times = result["times"][1:]
    axes.plot(times, 1e3 * result["guess"]["field"][:, 0], color=GUESS, lw=0.7, label="$B_x$, guess")
    for name, color, k in (("y", "#3d9970", 1), ("z", "#b07aa1", 2), ("x", FOUND, 0)):
        axes.plot(times, 1e3 * result["found"]["field"][:, k], color=color, lw=1.0, label=f"$B_{name}$")
    axes.set(xlabel="time [s]", ylabel="B [mT]", xlim=(0, times[-1]))
    axes.legend(frameon=False, fontsize=7, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))


def draw_convergence(axes, result: dict) -> None:
    iterations = [record.iteration for record in result["history"]]
    axes.semilogy(
        iterations,
        [1e6 * record.objective for record in result["history"]],
        "o-",
        color="k",
        ms=3,
        label="objective",
    )
    for name, color in (("distance", FOUND), ("strength", GUESS), ("low frequency", "#3d9970")):
        values = np.array([1e6 * record.terms[name] for record in result["history"]])
        axes.semilogy(iterations, np.where(values > 0, values, np.nan), color=color, lw=1.0, label=name)
    axes.set(xlabel="iteration", ylabel="objective [mm$^2$]")
    axes.legend(frameon=False, fontsize=7)


def movie(result: dict, path, fps: int = 25, slower: float = 2.0) -> None:
    """The motion found, in slow motion, with the field's component along the channel."""
    from matplotlib import pyplot as plt
    from matplotlib.animation import PillowWriter

    figure, axes = plt.subplots(figsize=(6, 3.2))
    writer, times, motion = PillowWriter(fps=fps), result["times"], result["found"]
    with writer.saving(figure, str(path), dpi=80):
        for time in np.arange(0.0, times[-1], 1 / (fps * slower)):
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
    """What a person would ask first."""
    return "\n".join(_about(name, result) for name, result in results.items())


def _about(name: str, result: dict) -> str:
    steps, iterations = len(result["times"]) - 1, max(result["iterations"], 1)
    first, last = result["history"][0], result["history"][-1]
    forward = 1e3 * result["found"]["processor_time"] / steps
    both = 1e3 * result["processor_time"] / (last.evaluations * steps)
    theirs, seconds = PAPER[name]
    end = 1e3 * result["channel"].end
    return "\n".join(
        (
            f"{name}: {steps} steps, {result['variables']} variables; passed when all is beyond {end:.0f} mm",
            *(_about_motion(LABELS[which], result[which]) for which in ("guess", "found")),
            f"  objective {1e6 * first.objective:.1f} to {1e6 * result['objective']:.1f} mm2 in {result['iterations']} "
            f"iterations, {last.evaluations} motions ({result['reason']})",
            f"  {last.seconds / iterations:.1f} s an iteration, {result['processor_time'] / iterations:.1f} s of processor "
            f"time; a motion {forward:.2f} ms a step, {both:.2f} ms with its gradient",
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
