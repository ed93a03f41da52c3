"""Tables, curves and pictures of the hands."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from _solid_designs.table import Outcome, table

import magshell as ms

from .design import FLUX_DENSITY, LARGEST_MAGNETIZATION, rms
from .gestures import Anchors
from .shape import FINGERS

# [Chen22] Table 1, the rows "Hand": seconds an iteration on a six-core Intel i7-8700, faces, tetrahedra, variables.
PAPER_SECONDS = (1.2e2 / 16, 5.9e3 / 45)
PAPER_FACES, PAPER_TETRAHEDRA, PAPER_VARIABLES = 3320, 4975, 1000

VIEW = (12, -62)  # elevation and azimuth, degrees
BLUE, RED, GREY, GREEN = "#20639b", "#c8442d", "#777777", "#1b7f5c"
COLORS = {"linear": BLUE, "linear, the paper's faces": GREY, "quadratic": RED}


def outcomes(entry: dict) -> Iterable[Outcome]:
    """Yield the outcomes of one gesture: every design on its own mesh, and on the converged one."""
    for name, design in entry["designs"].items():
        yield Outcome(
            f"{name}: as designed",
            design.body.solid,
            design.rms_distance,
            design.iterations,
            design.seconds_per_iteration,
        )
        if name in entry["converged"]:
            there = entry["converged"][name]
            yield Outcome("   on the converged mesh", there.body.solid, there.rms_distance)


def summary(result: dict) -> str:
    lines = [
        f"A hand {100 * hand_height(result):.1f} cm high, in {1e3 * FLUX_DENSITY[2]:g} mT upwards; |M_r| below "
        f"{1e-3 * LARGEST_MAGNETIZATION:g} kA/m. Distances of the anchors from their targets:",
    ]
    for gesture, entry in result.items():
        lines += ["", f"{gesture}: {1e3 * entry['way']:.1f} mm to go", table(outcomes(entry))]
        for name, design in entry["designs"].items():
            lines.append(f"   {name + ':':28s} {by_finger(design.distances, design.anchors)}")
        for name, there in entry["converged"].items():
            lines.append(f"   {name + ', converged:':28s} {by_finger(there.distances, there.anchors)}")
    lines += ["", *paper_comparison(result)]
    return "\n".join(lines)


def hand_height(result: dict) -> float:
    design = next(iter(next(iter(result.values()))["designs"].values()))
    return float(np.ptp(design.body.solid.mesh.rest_positions[:, 2]))


def by_finger(distances: np.ndarray, anchors: Anchors) -> str:
    each = (rms(distances[anchors.fingers == k]) for k in range(len(FINGERS)))
    return ", ".join(f"{finger.name} {1e3 * d:.2f}" for finger, d in zip(FINGERS, each, strict=True)) + " mm"


def paper_comparison(result: dict) -> list[str]:
    designs = [entry["designs"] for entry in result.values()]
    seconds = [each["linear"].seconds_per_iteration for each in designs]
    body, fine = designs[0]["linear"].body, designs[0]["linear, the paper's faces"].body
    return [
        f"[Chen22] Table 1, Hand: {PAPER_FACES} faces, {PAPER_TETRAHEDRA} tetrahedra, {PAPER_VARIABLES} variables, "
        f"{PAPER_SECONDS[0]:.1f} to {PAPER_SECONDS[1]:.0f} s an iteration on six cores.",
        f"The work of {body.solid.mesh.n_tetrahedra} tetrahedra takes {min(seconds):.2f} to {max(seconds):.2f} s an "
        f"iteration here, with {3 * body.solid.mesh.n_faces} variables; the paper's mesh has no",
        f"node inside, ours has, so it shows {body.solid.mesh.n_faces} faces; {fine.solid.mesh.n_faces} faces take "
        f"{fine.solid.mesh.n_tetrahedra} tetrahedra. Its size, targets and the unit of its residual are not printed.",
    ]


def draw_convergence(axes, result: dict) -> None:
    """Draw the rms distance against iterations and seconds, one line for each gesture and element."""
    for style, (gesture, entry) in zip(("-", (0, (4, 1.5)), ":"), result.items(), strict=False):
        for name, design in entry["designs"].items():
            color = COLORS[name]
            for axis, across in zip(axes, ("iteration", "seconds"), strict=True):
                axis.semilogy(
                    [getattr(record, across) for record in design.history],
                    1e3 * design.rms_history,
                    color=color,
                    ls=style,
                    lw=1.6,
                    label=f"{gesture}, {name}",
                )
    axes[0].set(xlabel="iteration", ylabel="anchors from their targets, rms [mm]")
    axes[1].set(xlabel="wall time [s]", xscale="log")
    axes[0].legend(frameon=False, fontsize=7)


def draw_hands(result: dict, width: int = 2400):
    """Draw one row of pictures for each gesture.

    Columns: the magnetization on the hand at rest; the linear design as found, and on the converged mesh; the quadratic
    design on the converged mesh. Targets are rings, anchors dots; a line joins each pair.
    """
    from matplotlib import pyplot as plt

    columns = (
        "at rest, with $M_r$ (linear elements)",
        "found with linear elements",
        "the same $M_r$, converged mesh",
        "found with quadratic elements,\nconverged mesh",
    )
    figure, axes = plt.subplots(
        len(result), 4, figsize=(12, 3.55 * len(result) + 0.4), squeeze=False, layout="constrained"
    )
    for row, (gesture, entry) in zip(axes, result.items(), strict=True):
        linear = entry["designs"]["linear"]
        mesh = linear.body.solid.mesh.surface
        rest = dict(
            remanent_magnetization=linear.remanent_magnetization,
            style=ms.Style(arrows=220, show_field=False),
        )
        _paint(row[0], mesh, mesh.rest_positions, width // 4, **rest)
        shown = (linear, entry["converged"]["linear"], entry["converged"]["quadratic"])
        for axis, state in zip(row[1:], shown, strict=True):
            surface = state.body.solid.mesh.surface
            at = state.positions[state.body.solid.mesh.surface_vertices]
            _paint(axis, surface, at, width // 4, style=ms.Style(show_field=False))
            _mark(axis, state)
            axis.text(
                0.02,
                0.02,
                f"{1e3 * state.rms_distance:.2f} mm",
                transform=axis.transAxes,
                fontsize=9,
                color=RED,
            )
        row[0].set_ylabel(gesture, fontsize=11)
    for axis, title in zip(axes[0], columns, strict=True):
        axis.set_title(title, fontsize=10)
    return figure


def projected(points: np.ndarray) -> np.ndarray:
    """Return the projection of points onto the screen, (n, 2) m."""
    elevation, azimuth = np.radians(VIEW)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array(
        [
            -np.sin(elevation) * np.cos(azimuth),
            -np.sin(elevation) * np.sin(azimuth),
            np.cos(elevation),
        ]
    )
    return points @ np.stack([right, up], axis=1)


def _paint(axis, mesh: ms.TriangleMesh, positions: np.ndarray, width: int, **how) -> None:
    """Draw a picture of ms.plot within these axes, in metres of the screen."""
    picture = ms.plot(mesh, positions=positions, view=VIEW, width=width, color=None, **how)
    panel = picture.figure.axes[0]
    for image in panel.images:
        axis.imshow(image.get_array(), extent=image.get_extent(), origin=image.origin)
    axis.set(xlim=panel.get_xlim(), ylim=panel.get_ylim(), xticks=[], yticks=[], aspect="equal")
    axis.spines[:].set_visible(False)


def _mark(axis, state) -> None:
    reached = projected(state.positions[state.anchors.vertices])
    wanted = projected(state.anchors.targets)
    for a, b in zip(reached, wanted, strict=True):
        axis.plot(*np.stack([a, b], axis=1), color=RED, lw=0.8)
    axis.plot(*wanted.T, "o", ms=4.2, mfc="none", mec=GREEN, mew=1.0)
    axis.plot(*reached.T, ".", ms=3.4, color="#22272e")
