"""The figure, the movies, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms

from .model import CELL, FREQUENCY, LEG, ROOTS, THICKNESS, TIME_STEP, Crawler, across
from .study import Row, advances

COLORS = {"flat": "#3f9c7a", "bump": "#20639b", "slope": "#d98a1f"}
RED, GREY, EARTH = "#c8442d", "#777777", "#d9d3c7"
VIEW = (20, -65)


def draw_side(axes, who: Crawler, motion: ms.Trajectory, name: str, shown: int = 3) -> None:
    """Draw body and feet from the side at a few times, above the ground."""
    mesh = who.scene.mesh
    x, y, _ = mesh.rest_positions.T
    spine = np.flatnonzero(np.isclose(np.abs(y), CELL / 2) & (y > 0))
    spine = spine[np.argsort(x[spine])]
    feet = [_foot(mesh, root) for root in ROOTS]
    low, high = (1e3 * motion.positions[..., 0].min() - 2, 1e3 * motion.positions[..., 0].max() + 2)
    ground = np.linspace(low, high, 400)
    heights = 1e3 * who.ground.height(1e-3 * ground)
    axes.fill_between(ground, heights, heights.min() - 1.5, color=EARTH, lw=0)
    for number, frame in enumerate(np.linspace(0, len(motion) - 1, shown).round().astype(int)):
        alpha = 0.35 + 0.65 * number / (shown - 1)
        positions = 1e3 * motion.positions[frame]
        axes.plot(*positions[spine][:, [0, 2]].T, color=COLORS[name], lw=2.5, alpha=alpha)
        for pair, leg in enumerate(feet):
            color, way = (RED, "inwards") if pair % 2 else (GREY, "outwards")
            label = f"leg magnetized {way}" if number == shown - 1 and pair < 2 else None
            axes.plot(*positions[leg][:, [0, 2]].T, color=color, lw=1, alpha=alpha, label=label)
        axes.annotate(
            f"{motion.times[frame]:.3g} s",
            positions[spine[-1]][[0, 2]],
            xytext=(3, 6),
            textcoords="offset points",
            fontsize=8,
            color=GREY,
        )
    axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", xlim=(low, high))
    axes.margins(y=0.15)


def _foot(mesh: ms.TriangleMesh, root: int) -> np.ndarray:
    """Return the vertices along the middle of a leg, from the body to the tip, on the side of positive y."""
    x, y, _ = mesh.rest_positions.T
    leg = np.flatnonzero(np.isclose(x, across()[0][root + LEG[0] // 2]) & (y > 0))
    return leg[np.argsort(y[leg])]


def draw_progress(axes, walks: dict) -> None:
    for name, (who, motion) in walks.items():
        center = 1e3 * who.centers(motion)
        axes.plot(motion.times, center[:, 0] - center[0, 0], color=COLORS[name], label=name)
    axes.set(xlabel="time [s]", ylabel="center's way along x [mm]")
    axes.legend(frameon=False)


def draw_paths(axes, walks: dict) -> None:
    """Draw the height of the center above the ground below it."""
    for name, (who, motion) in walks.items():
        x, _, z = who.centers(motion).T
        axes.plot(1e3 * x, 1e3 * (z - who.ground.height(x)), color=COLORS[name], label=name)
    axes.set(xlabel="center's x [mm]", ylabel="its height above ground [mm]")


def picture(who: Crawler, motion: ms.Trajectory, shown: int = 9) -> ms.Picture:
    """Draw the last rotation of the field."""
    a_turn = round(1 / (FREQUENCY * (motion.times[1] - motion.times[0])))
    chosen = np.linspace(len(motion) - 1 - a_turn, len(motion) - 1, shown).round().astype(int)
    mesh, drawn = _on_the_floor(who, motion, chosen)
    titles = [f"{time:.3f} s" for time in motion.times[chosen]]
    return ms.plot(mesh, **drawn, titles=titles, view=VIEW, columns=3, style=ms.Style(arrows=False))


def movie(who: Crawler, motion: ms.Trajectory, path: Path, title: str, **options) -> Path:
    mesh, drawn = _on_the_floor(who, motion, np.arange(len(motion)))
    return ms.animate(
        mesh,
        path,
        **drawn,
        times=motion.times,
        title=title,
        view=VIEW,
        progress=False,
        **{"width": 800, "speed": 0.1, "fps": 20.0} | options,
        style=ms.Style(arrows=False),
    )


def _on_the_floor(who: Crawler, motion: ms.Trajectory, chosen: np.ndarray) -> tuple[ms.TriangleMesh, dict]:
    """Return one mesh of crawler and ground, the ground without magnetization, and the plot's states."""
    mesh = who.scene.mesh
    points, faces = _floor(who, motion)
    both = ms.TriangleMesh(
        np.concatenate([mesh.rest_positions, points]), np.concatenate([mesh.faces, mesh.n_vertices + faces])
    )
    resting = np.broadcast_to(points, (len(chosen), *points.shape))
    return both, {
        "positions": np.concatenate([motion.positions[chosen], resting], axis=1),
        "remanent_magnetization": np.concatenate([who.remanent_magnetization, np.zeros((len(faces), 3))]),
        "applied_flux_density": motion.applied_flux_density[chosen],
    }


def _floor(who: Crawler, motion: ms.Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return the ground at the height of the sheet's lower side, for drawing: vertices (n, 3) m, faces (m, 3)."""
    low, high = motion.positions.min(axis=(0, 1)) - CELL, motion.positions.max(axis=(0, 1)) + CELL
    floor = ms.meshes.rectangle(high[0] - low[0], high[1] - low[1], cells=(40, 4))
    points = floor.rest_positions + np.array([low[0], low[1], 0.0])
    points[:, 2] = who.ground.height(points[:, 0]) - THICKNESS / 2
    return points, floor.faces


def summary(result: dict) -> str:
    return "\n\n".join(part for part in (_walks(result), _study(result["study"])) if part)


def _walks(result: dict) -> str:
    turn = 1 / FREQUENCY
    lines = [
        f"In steps of {1e3 * result['time_step']:g} ms    mm along x in each turn of the field ({turn:g} s)"
    ]
    for name, (who, motion) in result["walks"].items():
        ways = "  ".join(f"{1e3 * way:6.3f}" for way in advances(who, motion)[:, 0])
        lines.append(f"  {name:<7}{ways}")
        lines.append(
            f"         {motion.iterations / motion.steps_done:.2f} iterations a step, "
            f"{len(motion.substeps)} of {motion.steps_done} in parts, "
            f"{1e3 * motion.wall_time / motion.steps_done:.2f} ms of wall time a step"
        )
    back = 1e3 * advances(*result["back"])[0, 0]
    lines.append(f"  flat, field turned the other way: {back:.4f} in the first turn")
    return "\n".join(lines)


def _study(rows: list[Row]) -> str:
    if not rows:
        return ""
    lines = [
        "On flat ground, the second turn        step [ms]   advance [mm]   iterations   processor [ms a step]"
    ]
    for row in rows:
        advance = f"{'':>12}" if row.advance is None else f"{1e3 * row.advance:12.4f}"
        lines.append(
            f"  {row.what:<36}{1e3 * row.time_step:10.1f}   {advance}   "
            f"{row.iterations:10.2f}   {1e3 * row.cpu:10.2f}"
        )
    lines.append(f"  The paper's step is {1e3 * TIME_STEP:g} ms.")
    return "\n".join(lines)
