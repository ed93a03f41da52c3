"""The figures of one letter and of several: properties of the sheet, its shapes, and the convergence of the search."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from scipy.spatial import cKDTree

import magshell as ms

from .designs import MODULI, VARIANTS, Design
from .paper import ITERATIONS, RESIDUAL, TIME
from .relief import bare, draw_relief
from .task import LARGEST_MAGNETIZATION, RELIEF

NAMES = dict(zip(VARIANTS, ("$M_r$", "$M_r, Y$", "$M_r, Y, c$"), strict=True))
COLORS = dict(zip(VARIANTS, ("#777777", "#20639b", "#c8442d"), strict=True))
STYLES = ("-", (0, (4, 1.5)), ":", "-.")
ARROWS = 24  # along a side


def draw_designs(axes, result: dict) -> None:
    """Draw one row for each letter: magnetization and modulus of the joint design, shapes of the variants, the
    target.
    """
    for row, entry in zip(axes, result.values(), strict=True):
        mesh, designs = entry["task"].mesh, entry["designs"]
        joint: Design = designs[VARIANTS[-1]]
        magnetization = draw_magnetization(row[0], mesh, joint.remanent_magnetization)
        modulus = draw_modulus(row[1], mesh, joint.young_modulus)
        for place, design in zip(row[2:5], designs.values(), strict=True):
            draw_relief(place, mesh, design.positions)
            place.set_xlabel(f"error {100 * design.error:.1f} %")
        draw_relief(row[5], mesh, entry["task"].target.numpy())
    joint_name = NAMES[VARIANTS[-1]]
    titles = (f"magnetization of {joint_name}", f"modulus of {joint_name}", *NAMES.values(), "target")
    for place, title in zip(axes[0], titles, strict=True):
        place.set_title(title, fontsize=11)
    for place, colors, label in (
        (axes[-1, 0], magnetization, "$M_z$ [kA/m]"),
        (axes[-1, 1], modulus, "$Y$ [Pa]"),
    ):
        bar = place.inset_axes((0.1, -0.08, 0.8, 0.035))
        place.figure.colorbar(colors, cax=bar, orientation="horizontal", label=label)


def draw_magnetization(axes, mesh: ms.TriangleMesh, magnetization: np.ndarray):
    """Draw the component along the field as colour and the component in the plane as arrows."""
    x, y, _ = 1e3 * mesh.rest_positions.T
    largest = 1e-3 * LARGEST_MAGNETIZATION
    colors = axes.tripcolor(
        x,
        y,
        mesh.faces,
        1e-3 * magnetization[:, 2],
        cmap="RdBu_r",
        norm=Normalize(-largest, largest),
        rasterized=True,
    )
    raster = (np.arange(ARROWS) + 0.5) / ARROWS
    squares = np.stack(np.meshgrid(raster * np.ptp(x), raster * np.ptp(y)), axis=-1).reshape(-1, 2)
    places = 1e3 * mesh.face_barycenters[:, :2]
    _, near = cKDTree(places).query(squares, k=4)
    arrows = 1e-3 * magnetization[near].mean(axis=1)[:, :2]
    long = np.linalg.norm(arrows, axis=1) > 0.08 * largest
    axes.quiver(
        *places[near].mean(axis=1)[long].T,
        *arrows[long].T,
        scale=0.6 * ARROWS * largest,
        width=0.005,
        headwidth=3.6,
        headlength=3.8,
        headaxislength=3.4,
        minlength=0.0,
        color="#1d2129",
    )
    bare(axes)
    return colors


def draw_modulus(axes, mesh: ms.TriangleMesh, young_modulus: np.ndarray):
    x, y, _ = 1e3 * mesh.rest_positions.T
    colors = axes.tripcolor(
        x, y, mesh.faces, young_modulus, cmap="plasma", norm=LogNorm(*MODULI), rasterized=True
    )
    bare(axes)
    return colors


def draw_convergence(axes, result: dict) -> None:
    """Draw the sum of squares against iterations and against time; the right axis shows the corresponding error."""
    by_iteration, by_time = axes
    for (letter, entry), style in zip(result.items(), STYLES, strict=False):
        for variant, design in entry["designs"].items():
            line = {"color": COLORS[variant], "ls": style, "lw": 1.5}
            seconds = [record.seconds for record in design.history]
            squares = 1e6 * design.errors**2 * RELIEF**2 * len(design.positions)
            by_iteration.semilogy(squares, **line)
            by_time.loglog(seconds, squares, **line, label=f"{letter}  {NAMES[variant]}")
    count = len(design.positions)
    right = by_time.secondary_yaxis(
        "right",
        functions=(
            lambda squares: 1e2 * np.sqrt(np.maximum(squares, 0.0) / (1e6 * count)) / RELIEF,
            lambda error: (1e-2 * error * RELIEF) ** 2 * 1e6 * count,
        ),
    )
    right.set_ylabel("rms error / height of the letter [%]")
    right.set_yticks([3, 5, 10, 20, 30], ["3", "5", "10", "20", "30"])
    right.minorticks_off()
    by_time.axvline(TIME, color="#444444", lw=1)
    by_time.text(
        0.75 * TIME,
        0.97,
        f"[Chen22]\n{ITERATIONS} iterations\nin {TIME:,.0f} s;\nresidual {RESIDUAL},\nunit not stated",
        ha="right",
        va="top",
        fontsize=9,
        transform=by_time.get_xaxis_transform(),
    )
    by_iteration.set(xlabel="iteration", ylabel="sum of squared distances [mm$^2$]")
    by_time.set(xlabel="time [s]", xlim=(0.1, 1e5))
    by_time.legend(frameon=False, fontsize=9, loc="lower left")
    for place in axes:
        place.spines["top"].set_visible(False)
        place.grid(True, which="major", color="0.92", lw=0.6)
    by_iteration.spines["right"].set_visible(False)
