"""The table and the pictures."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .deformations import DEFORMATIONS

COLORS = {"along": "#20639b", "across": "#8fbf9f", "normal": "#c8442d"}
MARKERS = {2: "o", 4: "s", 6: "^"}
ROUND_OFF = 1e-16  # below it a logarithmic axis shows nothing


def summary(result: dict) -> str:
    """Return one line for each deformation and magnetization, at the largest angle, for every number of layers."""
    rows = result["rows"]
    largest = max(row["angle"] for row in rows)
    lines = [
        f"Ends turned against each other by {np.degrees(largest):.0f} degrees; {2 * np.prod(result['cells'])} faces.",
        "",
        "deformation        M        layers   tetrahedra   volume [J]          shell [J]            total   accumulated",
    ]
    for row in rows:
        if row["angle"] == largest:
            lines.append(
                f"{row['deformation']:17s}  {row['magnetization']:7s}  {row['layers']:6d}   {row['tetrahedra']:10d}   "
                f"{row['volume']:16.12f}  {row['shell']:16.12f}   {row['total']:9.1e}   {row['accumulated']:9.1e}"
            )
    straight = [row for row in rows if row["deformation"] != "twisted, sheared"]
    in_plane = max(row["accumulated"] for row in straight if row["magnetization"] != "normal")
    normal = max(row["accumulated"] for row in straight if row["magnetization"] == "normal")
    predicted = max(row["predicted"] for row in rows)
    lines += [
        "",
        f"Straight normals, all angles, accumulated: magnetized in the plane {in_plane:.1e} at most, along the normal "
        f"{normal:.1e},",
        f"which is the cells': their share of a bent plate's energy is (angle / cells)^2 / 8, {predicted:.1e} at most.",
    ]
    return "\n".join(lines)


def draw_differences(axes, result: dict) -> None:
    """Draw the accumulated difference against the angle; one axis for each deformation."""
    for axis, deformation in zip(axes, DEFORMATIONS, strict=True):
        for magnetization, color in COLORS.items():
            for layers, marker in MARKERS.items():
                chosen = [
                    row
                    for row in result["rows"]
                    if (row["deformation"], row["magnetization"], row["layers"])
                    == (deformation, magnetization, layers)
                ]
                axis.semilogy(
                    np.degrees([row["angle"] for row in chosen]),
                    [max(row["accumulated"], ROUND_OFF) for row in chosen],
                    color=color,
                    marker=marker,
                    ms=9 - layers,
                    mfc="none",
                    lw=1.2,
                    label=f"$M_r$ {magnetization}, {layers} layers",
                )
        axis.set(title=deformation, xlabel="turn of the ends [deg]", ylim=(1e-17, 10))
    axes[0].set_ylabel("shell against volume, accumulated over energy")
    axes[0].legend(frameon=False, fontsize=6, loc=(0.02, 0.2))


def draw_plates(result: dict) -> ms.Picture:
    """Draw the middle surface at the largest angle."""
    plate = next(iter(result["plates"].values()))
    largest = max(row["angle"] for row in result["rows"])
    shapes = [plate.shell_positions(DEFORMATIONS[name], largest) for name in ("bent", "twisted")]
    return ms.plot(
        plate.shell.mesh,
        positions=np.stack(shapes),
        titles=["bent", "twisted"],
        columns=2,
        view=(25, -60),
    )
