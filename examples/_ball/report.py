"""The figure, the movie, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _pasting import paste

import magshell as ms

from .model import PAPER_STRETCH, TIME_STEP

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"
COLORS = {(8, 2): "#3f9c7a", (16, 2): BLUE, (32, 2): RED, (16, 4): "#d98a1f"}
PAPER = {"Cloth": 930, "Rigid": 520, "MPM": 14, "theirs": 51}  # ms a step
VIEW = (14, -62)


def _heights(row: dict, frame: int) -> np.ndarray:
    """Return the height of every vertex in one frame, cm."""
    return 100 * row["motion"].positions[frame, :, 2]


def draw_snapshots(axes, row: dict) -> None:
    """Draw four states, from the start until the ball has left the sheet again."""
    motion = row["motion"]
    lowest = int(np.argmin(row["center"][:, 2]))
    off = lowest + int(np.argmax(row["forces"][lowest:] == 0))
    frames = [0, lowest // 2, lowest, min(off + 6, len(motion) - 1)]
    picture = ms.plot(
        motion,
        states=frames,
        color=ms.Color([_heights(row, frame) for frame in frames], label="height [cm]"),
        titles=[f"{1e3 * motion.times[frame]:.0f} ms" for frame in frames],
        view=VIEW,
        columns=len(frames),
        width=2200,
        style=ms.Style(mesh_lines=True, arrows=False, show_field=False),
    )
    paste(axes, picture)


def draw_shapes(axes, row: dict) -> None:
    times = 1e3 * row["motion"].times
    axes.plot(times, 100 * row["widths"], color=RED, lw=2, label="width of the ball")
    axes.plot(times, 100 * row["heights"], color=BLUE, lw=2, label="height of the ball")
    axes.axhline(100, color=GREY, lw=0.8, ls=":")
    axes.set(xlabel="time [ms]", ylabel="of the diameter at rest [%]", xlim=(0, times[-1]))
    axes.legend(frameon=False)


def draw_gaps(axes, rows: list[dict]) -> None:
    """Draw the distance of ball and sheet in every throw, over the minimum distance that contact maintains."""
    named = set()
    for row in rows:
        case = row["case"][:2]
        label = None if case in named else f"{row['sheet_nodes']} and {row['ball'][0]} nodes"
        named.add(case)
        near = np.where(np.isfinite(row["gaps"]), row["gaps"], np.nan) / row["least_gap"]
        axes.plot(1e3 * row["motion"].times, near, ".", ms=3, color=COLORS.get(case, GREY), label=label)
    axes.axhline(1.0, color="k", lw=1.2)
    axes.text(0.99, 0.985, "nothing nearer", va="top", ha="right", transform=axes.get_yaxis_transform())
    axes.set(xlabel="time [ms]", ylabel="distance over half the thickness", ylim=(0.97, 1.25))
    axes.legend(frameon=False, markerscale=3, fontsize=8, loc="upper left", ncols=2)


def movie(row: dict, path: Path, **options) -> Path:
    return ms.animate(
        row["scenery"].scene,
        path,
        positions=row["motion"].positions,
        times=row["motion"].times,
        color=ms.Color([_heights(row, frame) for frame in range(len(row["motion"]))], label="height [cm]"),
        view=VIEW,
        **{"width": 700, "speed": 0.1, **options},
        style=ms.Style(mesh_lines=True, arrows=False),
    )


def summary(result: dict) -> str:
    lines = [
        f"A soft ball thrown at a sheet, {len(result['shown']['motion']) - 1} steps of {1e3 * TIME_STEP:.0f} ms; "
        "means and largest deviations over the throws",
        "  sheet   ball           passes  gap/least  compression %   stretching %  strain %   Newton  halved  ms a step",
    ]
    for case in dict.fromkeys(row["case"][:2] for row in result["rows"]):
        lines.append("  " + _line([row for row in result["rows"] if row["case"][:2] == case]))
    soft = result["soft"]
    paper = ", ".join(f"{name} {time}" for name, time in PAPER.items())
    return "\n".join(
        [
            *lines,
            f"[Qiao21], ms a step: {paper}; penetration error 0.041 with Cloth, 0 with Rigid and theirs",
            f"With {PAPER_STRETCH:g} N/m, as their code has it, the sheet strains by {100 * soft['sheet_strain']:.0f} % "
            f"and the ball sinks to {soft['center'][:, 2].min():.2f} m; {soft['penetrations']} faces pass.",
        ]
    )


def _line(rows: list[dict]) -> str:
    def mean_and_deviation(name: str, scale: float) -> str:
        values = scale * np.array([row[name] for row in rows])
        return f"{values.mean():.3g} +- {np.abs(values - values.mean()).max():.2g}"

    nodes, tetrahedra = rows[0]["ball"]
    nearest = min(row["gaps"].min() / row["least_gap"] for row in rows)
    return (
        f"{rows[0]['sheet_nodes']:5d}   {f'{nodes} / {tetrahedra}':12s}"
        f"{sum(row['penetrations'] for row in rows):8d}{nearest:11.3f}"
        f"{mean_and_deviation('compression', 100):>15s}{mean_and_deviation('stretching', 100):>15s}"
        f"{100 * max(row['sheet_strain'] for row in rows):10.0f}{np.mean([row['newton'] for row in rows]):9.1f}"
        f"{sum(row['halved'] for row in rows):8d}  {mean_and_deviation('seconds_a_step', 1e3)}"
    )
