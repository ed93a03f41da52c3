"""The figure, the movies, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _pasting import paste

import magshell as ms

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"
VIEWS = {"fold": (12, -72), "coil": (14, -65)}


def draw_folding(axes, result: dict) -> None:
    """Draw four states until the strip is folded flat, and one as it opens again."""
    folded = int(np.argmax(result["angles"]))
    frames = [*np.linspace(0, folded, 4).round().astype(int), (folded + len(result["states"])) // 2]
    _draw(axes, result, "fold", frames)


def draw_coil(axes, result: dict) -> None:
    frames = np.linspace(0, len(result["states"]) - 1, 5).round().astype(int)
    _draw(axes, result, "coil", frames)


def _draw(axes, result: dict, name: str, frames) -> None:
    picture = ms.plot(
        [result["states"][frame] for frame in frames],
        titles=[f"field at {result['angles'][frame]:.0f} degrees" for frame in frames],
        obstacles=[],
        view=VIEWS[name],
        columns=len(frames),
        width=2200,
        style=ms.Style(arrows=12, show_field=False),
    )
    paste(axes, picture)


def draw_angles(axes, result: dict, name: str) -> None:
    """Draw the angle of the strip's end and the force between its parts against the angle of the field."""
    there = slice(0, int(np.argmax(result["angles"])) + 1)
    back = slice(there.stop - 1, None)
    turned = result["turned"] - result["turned"][0]
    axes.plot(result["angles"][there], turned[there], "o-", ms=3, color=BLUE, label="there")
    if name == "fold":
        axes.plot(result["angles"][back], turned[back], "o--", ms=3, mfc="w", color=BLUE, label="back")
    axes.set(xlabel="angle of the field [degrees]", ylabel="the end has turned by [degrees]")
    axes.yaxis.label.set_color(BLUE)
    right = axes.twinx()
    right.plot(result["angles"][there], 1e3 * result["forces"][there], "-", color=RED)
    if name == "fold":
        right.plot(result["angles"][back], 1e3 * result["forces"][back], "--", color=RED)
        axes.legend(frameon=False, loc="upper left")
    right.set_ylabel("force between parts [mN]", color=RED)
    right.spines["top"].set_visible(False)
    axes.set_title(name, loc="left", fontweight="bold")


def movie(result: dict, path: Path, **options) -> Path:
    return ms.animate(
        result["states"],
        path,
        view=(12, -72),
        **{"width": 700, "fps": 8, **options},
        style=ms.Style(arrows=12),
    )


def summary(result: dict) -> str:
    lines = ["Strips that touch themselves"]
    for name, each in result.items():
        lines.append(
            f"  {name}: {len(each['states'])} states; its end turns by {np.ptp(each['turned']):.0f} degrees, "
            f"{each['pairs'].max()} pairs touch with {1e3 * each['forces'].max():.2f} mN at most, never nearer than "
            f"{1e3 * each['gaps'].min():.3f} mm (least {1e3 * each['least_gap']:.3f}); {each['crossings']} faces pass; "
            f"largest bending strain {100 * each['strain']:.0f} %; {each['iterations'].sum()} iterations, "
            f"{each['processor_time']:.0f} s"
        )
    fold = result["fold"]
    folded = int(np.argmax(fold["angles"]))
    back = np.abs(fold["positions"][-1] - fold["positions"][0]).max()
    return "\n".join(
        [
            *lines,
            f"  folded, the upper leaf's middle surface is {1e3 * fold['end_heights'][folded]:.2f} to "
            f"{1e3 * fold['end_tops'][folded]:.2f} mm high; opened again, it is within {1e6 * back:.2g} um of the start",
        ]
    )
