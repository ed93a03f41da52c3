"""The figure, the pictures, and the summary that is printed."""

from __future__ import annotations

import numpy as np

import magshell as ms

COLORS = {
    "both": "#20639b",
    "topology alone": "#c8442d",
    "magnetization alone": "#4c9f70",
    "strip": "#777777",
}
FINE = "both, refined"


def draw_design(axes, design: dict) -> None:
    """Draw the faces that remain, and arrows of the magnetization within the sheet."""
    mesh = design["mesh"]
    x, y, _ = 1e3 * mesh.rest_positions.T
    axes.tripcolor(x, y, mesh.faces, design["densities"][design["faces"]], cmap="Greys", vmin=0.0, vmax=1.3)
    chosen = np.arange(0, mesh.n_faces, max(1, mesh.n_faces // 150))
    at = 1e3 * mesh.face_barycenters[chosen]
    along = design["magnetization"][design["faces"]][chosen]
    axes.quiver(*at[:, :2].T, *along[:, :2].T, color="#c8442d", width=3e-3)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="matter and magnetization")


def draw_search(axes, designs: dict[str, dict]) -> None:
    """Draw the objective over the evaluations."""
    for name, design in designs.items():
        if name == FINE:
            continue
        if "history" in design:
            sums = 1e3 * design["history"][:, 1:3].sum(axis=1)
            axes.plot(np.arange(len(sums)), sums, color=COLORS[name], label=name)
        else:
            axes.axhline(1e3 * design["heights"].sum(), color=COLORS[name], ls=":", label=name)
    axes.set(xlabel="evaluation", ylabel="height in the field + height without [mm]", title="the search")
    axes.legend(frameon=False)


def pictures(result: dict) -> dict[str, ms.Picture]:
    """Draw the arm at rest, without the field and in it."""
    design = result["designs"].get(FINE, result["designs"]["both"])
    mesh, (up, down) = design["mesh"], design["positions"]
    return {
        "arm": ms.plot(
            mesh,
            positions=np.stack([mesh.rest_positions, down, up]),
            remanent_magnetization=design["magnetization"][design["faces"]],
            color="magnetization",
            titles=["flat", "loaded, without the field", "loaded, in the field"],
            view=(24, -60),
            columns=3,
            width=1800,
            style=ms.Style(arrows=80),
        )
    }


def summary(result: dict) -> str:
    """Return the printed lines."""
    lines = [f"{result['faces']} faces, {100 * result['volume']:.0f} % of them matter.", ""]
    lines.append(f"{'':<22}{'in the field':>14}{'without':>10}{'sum':>8}{'volume':>9}{'field':>9}")
    for name, design in result["designs"].items():
        up, down = 1e3 * design["heights"]
        lines.append(
            f"{name:<22}{up:11.2f} mm{down:7.2f} mm{up + down:8.2f}{100 * design['volume']:7.1f} %"
            f"{np.degrees(design['angle']):6.1f} deg"
        )
    lines.append("")
    for name, heights in result["forms"].items():
        up, down = 1e3 * heights
        lines.append(f"The {name} design: {up:.2f} mm in the field, {down:.2f} mm without.")
    for name in ("both", FINE):
        if name in result["designs"]:
            lines.append(_costs(name, result["designs"][name]))
    return "\n".join(lines)


def _costs(name: str, design: dict) -> str:
    """Return the line on the time and memory of a search."""
    seconds, evaluations = design["seconds"], len(design["history"])
    return (
        f"The search of {name}: {len(design['densities'])} faces, {evaluations} evaluations of both loads in "
        f"{seconds['all']:.1f} s, of them {seconds['solves']:.1f} s in solves; {design['memory'] / 1e6:.0f} MB at most."
    )
