"""The figure of examples/jumping_starfish.py, its movies, and the summary that is printed."""

from __future__ import annotations

import numpy as np
from _solid_designs.table import Outcome, table
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from .jump import BAR, BAR_HEIGHT, BAR_WIDTH, DOWN, OVER, OVER_TIME, TIME_STEP

COLORS = {"heavy": "#e08a2e", "light": "#4f9d69", "light, cheap field": "#2f7f86"}
BAR_COLOR, EARTH, GREY = "#d6478f", "#d9d3c7", "#777777"
FIELD_COLORS = {"x": "#20639b", "y": "#b9b9b9", "z": "#c8442d"}
RISE = np.radians(14.0)  # of the eye above the ground, from where it looks along y
LIGHT = np.array([-0.35, -0.6, 0.75])
LABELS = {
    "guess": "guess",
    "found": "linear",
    "converged": "linear's field, converged mesh",
    "again": "found with quadratic",
    "again converged": "its field, converged mesh",
}
PAPER = {"heavy": (42, 2.5e4), "light": (111, 4.5e4), "light, cheap field": (77, 3.9e4)}  # [Chen22] Table 1


def seen(points: np.ndarray) -> np.ndarray:
    """Return the coordinates of points (..., 3) m in the picture, to the right and up, (..., 2) mm."""
    x, y, z = np.moveaxis(1e3 * np.asarray(points), -1, 0)
    return np.stack([x, np.cos(RISE) * z + np.sin(RISE) * y], axis=-1)


def draw_starfish(axes, motion: dict, frame: int, color: str, alpha: float = 1.0) -> None:
    positions = motion["positions"][frame]
    corners = positions[motion["jump"].solid.mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    facing = normals @ np.array([0.0, -np.cos(RISE), np.sin(RISE)]) > 0
    corners, normals = corners[facing], normals[facing]
    shade = 0.5 + 0.5 * np.clip(normals @ LIGHT / np.linalg.norm(LIGHT), -0.6, 1.0)
    order = np.argsort(-corners[..., 1].mean(axis=1) + np.tan(RISE) * corners[..., 2].mean(axis=1))
    colors = (shade[:, None] * np.array(to_rgb(color)))[order].clip(0, 1)
    axes.add_collection(
        PolyCollection(seen(corners[order]), facecolors=colors, edgecolors=colors, lw=0.2, alpha=alpha)
    )


def draw_ground(axes, low: float = -17.0, high: float = 47.0, top: float = 30.0) -> None:
    """Draw the ground and the bar, which is as wide as the starfish. low, high, top: limits of the picture, mm."""
    axes.fill_between([low, high], -14 * np.sin(RISE), 14 * np.sin(RISE), color=EARTH, lw=0, zorder=0)
    sides = BAR + 0.5 * BAR_WIDTH * np.array([-1.0, 1.0])
    for y0, z0, y1, z1, shade in (
        (-0.014, 0, -0.014, BAR_HEIGHT, 0.85),
        (-0.014, BAR_HEIGHT, 0.014, BAR_HEIGHT, 1.0),
    ):
        box = [(sides[0], y0, z0), (sides[1], y0, z0), (sides[1], y1, z1), (sides[0], y1, z1)]
        color = shade * np.array(to_rgb(BAR_COLOR))
        axes.add_collection(PolyCollection([seen(box)], facecolors=[color], zorder=0.5))
    axes.set(xlim=(low, high), ylim=(-5, top), aspect="equal")
    axes.set_axis_off()


def draw_jump(axes, result: dict, name: str, which: str = "found") -> None:
    """Draw the whole jump in one picture, with the path of its center."""
    motion = result[which]
    draw_ground(axes)
    times = (0.0, 0.45 * OVER_TIME, OVER_TIME, 0.135, 0.2)
    for number, time in enumerate(times):
        frame = min(round(time / TIME_STEP), len(motion["positions"]) - 1)
        draw_starfish(axes, motion, frame, COLORS[name], alpha=1.0 if number in (0, 2, 4) else 0.75)
    axes.plot(*seen(motion["center"]).T, color="k", lw=0.8, ls="--", zorder=5)
    for place in (OVER, DOWN):
        axes.plot(*seen(place), "+", color=BAR_COLOR, ms=8, mew=1.6, zorder=6)


def draw_height(axes, result: dict, name: str) -> None:
    for which, style, color in (
        ("guess", ":", GREY),
        ("found", "-", COLORS[name]),
        ("converged", "--", COLORS[name]),
        ("again", "-", "k"),
    ):
        if which in result:
            motion = result[which]
            times, heights = 1e3 * motion["times"], 1e3 * motion["center"][:, 2]
            axes.plot(times, heights, style, color=color, lw=1.3, label=LABELS[which])
    lowest = result["found"]["lowest"]
    axes.fill_between(
        1e3 * result["found"]["times"], 0, 1e3 * np.maximum(lowest, 0), color=COLORS[name], alpha=0.2
    )
    axes.plot(1e3 * OVER_TIME, 1e3 * OVER[2], "+", color=BAR_COLOR, ms=9, mew=1.8)
    axes.set(
        xlabel="time [ms]", ylabel="height of the center [mm]", xlim=(0, 1e3 * result["found"]["times"][-1])
    )
    axes.legend(frameon=False, fontsize=7)


def draw_field(axes, motion: dict, until: int | None = None) -> None:
    """Draw the field found, of the first `until` steps or of all: [Chen22] Fig. 17."""
    field = 1e3 * motion["field"][:until]
    times = 1e3 * motion["times"][1 : 1 + len(field)]
    for k, label in ((1, "y"), (0, "x"), (2, "z")):
        axes.plot(times, field[:, k], color=FIELD_COLORS[label], lw=1.4, label=f"$B_{label}$")
    axes.axhline(0.0, color=GREY, lw=0.5)
    axes.set(xlabel="time [ms]", ylabel="B [mT]", xlim=(0, times[-1]))
    axes.legend(frameon=False, fontsize=7, ncols=3, loc="best")


def draw_take_off(axes, motion: dict, color: str, frame: int, letter: str) -> None:
    """Draw one picture of the take-off."""
    draw_ground(axes, -17, 22, 16)
    draw_starfish(axes, motion, frame, color)
    axes.set_title(f"({letter}) {1e3 * motion['times'][frame]:.1f} ms", fontsize=8)


def draw_convergence(axes, result: dict, name: str) -> None:
    for which, color in (("found", COLORS[name]), ("again", "k")):
        if which in result:
            history = result[which]["history"]
            axes.semilogy(
                [record.evaluations for record in history],
                [1e6 * record.objective for record in history],
                "o-",
                color=color,
                ms=3,
                label=LABELS[which],
            )
    axes.set(xlabel="motions", ylabel="objective [mm$^2$]")
    axes.legend(frameon=False, fontsize=7)


def movie(result: dict, name: str, path, which: str = "found", fps: int = 20, slower: float = 25.0) -> None:
    """Write the movie of the jump, in slow motion, with the field as an arrow."""
    from matplotlib import pyplot as plt
    from matplotlib.animation import PillowWriter

    motion = result[which]
    figure, axes = plt.subplots(figsize=(6.4, 3.9))
    writer, last = PillowWriter(fps=fps), len(motion["times"]) - 1
    with writer.saving(figure, str(path), dpi=80):
        for time in np.arange(0.0, motion["times"][-1], 1 / (fps * slower)):
            axes.clear()
            frame = min(round(time / TIME_STEP), last)
            draw_ground(axes)
            draw_starfish(axes, motion, frame, COLORS[name])
            field = 1e3 * motion["field"][max(frame - 1, 0)]
            start = np.array([-8.0, 22.0])
            if np.hypot(field[0], field[2]) > 1.0:
                axes.annotate(
                    "",
                    start + 0.2 * field[[0, 2]],
                    start,
                    arrowprops={"color": "k", "width": 1.5, "headwidth": 6},
                )
            axes.text(-8, 14, f"|B| = {np.linalg.norm(field):.0f} mT", ha="center", fontsize=8)
            axes.set_title(f"{name}: {1e3 * time:.0f} ms", fontsize=10)
            writer.grab_frame()
    plt.close(figure)


def summary(results: dict[str, dict]) -> str:
    """Return the summary of every design: distances from the requested positions, and the cost of the search."""
    return "\n\n".join(_about(name, result) for name, result in results.items())


def _about(name: str, result: dict) -> str:
    found = result["found"]
    theirs, seconds = PAPER[name]
    motions = [which for which in LABELS if which in result]
    each = 1e3 * found["motion_time"] / found["jump"].steps
    lines = [
        f"{name}: {result['design'].mass_density:g} kg/m3, {1e3 * found['jump'].solid.vertex_masses.sum():.2f} g; "
        f"{found['unknowns'].size} unknowns",
        *(_about_motion(LABELS[which], result[which]) for which in motions),
        table([_outcome(LABELS[which], result[which]) for which in motions], "rms distance [mm]"),
        f"  linear: {found['processor_time'] / max(found['evaluations'], 1):.1f} s a motion with its gradient, a motion "
        f"{each:.1f} ms a step in {found['newton']:.1f} iterations",
        f"  [Chen22] Table 1: {theirs} iterations, {seconds / theirs:.0f} s each on six cores",
    ]
    return "\n".join(lines)


def _outcome(what: str, motion: dict) -> Outcome:
    if "iterations" not in motion:
        return Outcome(what, motion["jump"].solid, motion["rms_distance"])
    iterations = motion["iterations"]
    return Outcome(
        what,
        motion["jump"].solid,
        motion["rms_distance"],
        iterations,
        motion["processor_time"] / max(iterations, 1),
    )


def _about_motion(label: str, motion: dict) -> str:
    apex = int(np.argmax(motion["center"][:, 2]))
    over = (
        "never above the bar"
        if np.isinf(motion["over"])
        else f"{1e3 * motion['over']:.1f} mm lowest above it"
    )
    return (
        f"  {label:<32}{'clears the bar' if motion['clears'] else 'does not clear the bar'} ({over}); highest "
        f"{1e3 * motion['center'][apex, 2]:.1f} mm at {1e3 * motion['times'][apex]:.0f} ms; field "
        f"{1e3 * motion['rms']:.1f} mT rms, at most {1e3 * motion['strongest']:.1f} mT; {motion['halved']} steps in parts"
    )
