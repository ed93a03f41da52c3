"""The figure, the movie, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _pasting import paste

import magshell as ms

BLUE, RED = "#20639b", "#c8442d"
SIDE = (8, -90)


def draw_bent(axes, bent: dict) -> None:
    picture = ms.plot(
        bent["rest"],
        color="fibre_stretch",
        view=SIDE,
        width=1800,
        titles=["upper muscle pulls"],
        style=ms.Style(rest=True),
    )
    paste(axes, picture)


def draw_swimming(axes, swims: dict) -> None:
    move = swims["move"]
    frames = np.linspace(len(move) // 2, len(move) - 1, 4).round().astype(int)
    states = ms.plot(
        move.scene.mesh,
        positions=move.positions[frames],
        color=ms.Color([on_faces(swims, k) for k in frames], label="activation"),
        titles=[f"{move.times[k]:.2f} s" for k in frames],
        view=SIDE,
        columns=len(frames),
        width=2200,
    )
    paste(axes, states)


def on_faces(swims: dict, frame: int) -> np.ndarray:
    """Return the activation of the tetrahedron behind each face of the strip."""
    move = swims["move"]
    (body,) = move.scene.bodies
    return move[body].strains(frame).muscles["activation"][body.mesh.face_tetrahedra]


def draw_path(axes, result: dict) -> None:
    for name, color in (("swims", BLUE), ("backwards", RED)):
        times = result[name]["move"].times
        axes.plot(times, -1e3 * result[name]["center"][:, 0], color=color, label=f"wave {LABELS[name]}")
    axes.set(xlabel="time [s]", ylabel="way of the middle,\nhead first [mm]")
    axes.legend(frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


LABELS = {"swims": "from head to tail", "backwards": "from tail to head"}


def movie(swims: dict, path: Path) -> None:
    ms.animate(swims["move"], path, color="activation", view=SIDE, progress=False)


def summary(result: dict) -> str:
    bent, lines = result["bent"], []
    lines.append(
        f"bent: curvature {bent['curvature']:.3f} 1/m, Timoshenko's bilayer {bent['theory']:.3f}; fibres shortened to "
        f"{bent['stretch']:.4f}"
    )
    for name, label in LABELS.items():
        each = result[name]
        move = each["move"]
        lines.append(
            f"wave {label}: {each['advance']:+.3f} body lengths in {move.times[-1]:.2f} s, "
            f"{1e3 * each['processor_time'] / move.steps_done:.0f} ms a step"
        )
    return "\n".join(lines)
