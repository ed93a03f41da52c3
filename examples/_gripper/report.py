"""The figure, the movie, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _pasting import paste

import magshell as ms

from .lift import CLOSED, END, RISE

BLUE, RED, GREEN, GREY = "#20639b", "#c8442d", "#3c8d5a", "#777777"
VIEW = (10, -70)


def _which(gripper) -> np.ndarray:
    return np.repeat([0.0, 1.0], [gripper.mesh.n_vertices, gripper.ball.mesh.n_vertices])


def draw_lift(axes, result: dict) -> None:
    motion = result["lift"]["motion"]
    frames = [int(np.argmin(np.abs(motion.times - time))) for time in (0, 0.5 * RISE, CLOSED, 0.34, END)]
    picture = ms.plot(
        motion,
        states=frames,
        titles=[f"{motion.times[frame]:.2f} s" for frame in frames],
        color=ms.Color([_which(result["gripper"])] * len(frames), names={0: "sheet", 1: "ball"}),
        obstacles=[],
        view=VIEW,
        columns=len(frames),
        width=2200,
        style=ms.Style(arrows=False, show_field=False),
    )
    paste(axes, picture)


def draw_design(axes, result: dict) -> None:
    gripper = result["gripper"]
    picture = ms.plot(
        gripper.mesh,
        remanent_magnetization=result["design"]["remanent_magnetization"],
        color="magnetization",
        view=(50, -70),
        width=1500,
        style=ms.Style(arrows=200),
    )
    paste(axes, picture)


def draw_convergence(axes, result: dict) -> None:
    axes.plot(np.sqrt(result["design"]["history"]), "o-", color=BLUE)
    axes.axhline(result["printed"].objective ** 0.5, ls="--", color=GREEN, label="printed, six directions")
    axes.legend(frameon=False, loc="upper right", fontsize=8)
    axes.set(xlabel="iteration", ylabel="rms distance from the wrapped shape [mm]", ylim=(0, None))


def draw_motion(axes, result: dict) -> None:
    curves = (
        ("lift", BLUE, "-", "ball, found"),
        ("lift_printed", GREEN, "--", "ball, printed"),
        ("without", RED, "-", "ball, start of the search"),
    )
    for name, color, style, label in curves:
        each = result[name]
        axes.plot(
            each["motion"].times,
            1e3 * (each["ball_height"] - each["ball_height"][0]),
            style,
            color=color,
            label=label,
        )
    lift = result["lift"]
    heights = 1e3 * (lift["sheet_height"] - lift["sheet_height"][0])
    axes.plot(lift["motion"].times, heights, color=GREY, ls=":", label="middle of the sheet")
    axes.set(xlabel="time [s]", ylabel="raised by [mm]", xlim=(0, END))
    axes.legend(frameon=False, loc="upper left", fontsize=8)


def movie(lift: dict, path: Path, **options) -> Path:
    return ms.animate(
        lift["motion"],
        path,
        view=VIEW,
        **{"width": 600, "speed": 0.1, **options},
        style=ms.Style(arrows=False),
    )


def summary(result: dict) -> str:
    design, printed, lift, without = (result[name] for name in ("design", "printed", "lift", "without"))
    raised = [
        1e3 * (each["ball_height"][-1] - each["ball_height"][0])
        for each in (lift, result["lift_printed"], without)
    ]
    return "\n".join(
        [
            f"A gripper of {result['gripper'].mesh.n_faces} faces",
            f"  rms distance from the wrapped shape: {design['history'][0] ** 0.5:.2f} mm at first, "
            f"{design['objective'] ** 0.5:.2f} mm after {len(design['history']) - 1} iterations, {design['seconds']:.1f} s",
            f"  with every face in one of six directions, at full strength: {printed.objective**0.5:.2f} mm; rounded at "
            f"once {_millimeters(printed.rounded_at_once)}; {printed.not_printable} faces cannot be printed",
            f"  the ball is raised by {raised[0]:.1f} mm, by {raised[1]:.1f} with what is printed; with the magnetization "
            f"that the search began with by {raised[2]:.1f}",
            f"  contact: {1e3 * lift['forces'].max():.0f} mN at most, {1e3 * lift['gaps'].min():.3f} mm apart at least "
            f"(least {1e3 * lift['least_gap']:.3f}); {lift['crossings']} faces pass; "
            f"{1e3 * lift['seconds'] / len(lift['motion']):.0f} ms a step",
        ]
    )


def _millimeters(square: float | None) -> str:
    """Return the square root of an objective in mm2 as text; it may be missing."""
    return "nothing" if square is None else f"{square**0.5:.2f} mm"
