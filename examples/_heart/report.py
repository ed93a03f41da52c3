"""Pictures, the movie, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _solid_designs.table import table

import magshell as ms

from .beating import EXPANDING, PERIOD, Beating
from .design import Design
from .paper import FACES, SECONDS, TETRAHEDRA
from .task import FLUX_DENSITY

NAMES = {"lower_half": "lower half", "ribbon": "ribbon"}
COLORS = {"lower_half": "#20639b", "ribbon": "#c8442d"}
VIEW = (8, -20)  # degrees: nearly along x, as the heart flattens along y
ARROWS = 150


def draw_search(axes, result: dict) -> None:
    """Draw the rms distance of the surface from its target at every iteration of each search."""
    for area, found in result["hearts"].items():
        for design, style in ((found["linear"], "--"), (found["quadratic"], "-")):
            label = f"{NAMES[area]}, {design.task.element} elements"
            axes.plot(1e3 * design.errors, style, color=COLORS[area], label=label)
    axes.set(xlabel="iteration", ylabel="rms distance from the target [mm]", ylim=(0, None))
    axes.legend(frameon=False, fontsize=8)


def draw_volumes(axes, field_axes, result: dict) -> None:
    """Draw the chamber's volume over time, above the field."""
    for area, found in result["hearts"].items():
        beats: Beating = found["beating"]
        axes.plot(
            beats.motion.times, 100 * beats.volumes / beats.at_rest, color=COLORS[area], label=NAMES[area]
        )
    axes.axhline(100, color="#999999", lw=0.8, ls=":")
    axes.set(ylabel="volume of the chamber [%]")
    axes.legend(frameon=False, fontsize=8, loc="upper right", ncols=2)
    axes.margins(y=0.2)
    field = 1e3 * beats.motion.applied_flux_density[:, 1]
    field_axes.plot(beats.motion.times, field, color="#1a7f5a")
    field_axes.set(xlabel="time [s]", ylabel="$B_y$ [mT]")


def states_of(beats: Beating) -> dict[str, int]:
    """Return the frames of the motion that are shown, by name."""
    return {"at rest": 0, "contracted": int(beats.volumes.argmin()), "expanded": int(beats.volumes.argmax())}


def picture(found: dict, area: str) -> ms.Picture:
    """Draw the heart at rest, contracted and expanded, coloured by its magnetization: a row of [Chen22] Fig. 16."""
    beats = found["beating"]
    states = states_of(beats)
    return ms.plot(
        beats.motion,
        states=list(states.values()),
        **_colors(found["quadratic"]),
        titles=[f"{NAMES[area]}, {name}" for name in states],
        view=VIEW,
        columns=3,
    )


def movie(found: dict, area: str, path: Path, **options) -> Path:
    return ms.animate(
        found["beating"].motion,
        path,
        **_colors(found["quadratic"]),
        title=NAMES[area],
        view=VIEW,
        progress=False,
        **({"width": 600, "speed": 0.5, "fps": 20.0} | options),
    )


def _colors(design: Design) -> dict:
    """Return the plot options that colour each face by its magnetization, kA/m."""
    mesh, skin = design.task.solid.mesh, design.task.solid.skin
    strength = np.zeros(mesh.n_faces)
    strength[skin.faces] = 1e-3 * np.linalg.norm(design.remanent_magnetization, axis=1)
    return {"color": ms.Color(strength, label="$|M_r|$ [kA/m]"), "style": ms.Style(arrows=ARROWS)}


def summary(result: dict) -> str:
    parts = [_of_area(area, found) for area, found in result["hearts"].items()]
    mesh, (top, bottom) = result["heart"].mesh, SECONDS
    away = -EXPANDING * FLUX_DENSITY[1]
    parts.append(
        f"{1e3 * FLUX_DENSITY[1]:g} mT contract, {1e3 * away:g} mT expand, {60 / PERIOD:.0f} beats a minute.\n"
        f"{mesh.n_tetrahedra} tetrahedra, {mesh.n_faces} faces; [Chen22] Table 1: {TETRAHEDRA}, {FACES}, "
        f"and an iteration took {top:.0f} and {bottom:.0f} s."
    )
    return "\n\n".join(parts)


def _of_area(area: str, found: dict) -> str:
    design, beats = found["quadratic"], found["beating"]
    volumes = ", ".join(f"{100 * volume:.1f}" for volume in found["volumes"])
    shares = 100 * beats.volumes / beats.at_rest
    seconds = beats.motion.wall_time / beats.motion.steps_done
    return (
        f"{NAMES[area]}: the surface is to go {1e3 * design.task.target_distance:.3f} mm (rms)\n{table(found['outcomes'])}\n"
        f"  the contracted chamber, in this order: {volumes} % of its volume at rest\n"
        f"  beating: {shares.min():.1f} to {shares.max():.1f} %, a stroke of {100 * beats.stroke:.1f} %; "
        f"{seconds:.2f} s a step"
    )
