"""The figure, and the summary that is printed."""

from __future__ import annotations

import numpy as np

from .design import CAP, FLUX_DENSITY, from_beam_theory
from .sheet import ARM_LENGTH, arm_coordinates

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"
COLORS = {"from beam theory": BLUE, "from none": RED}


def draw_objective(axes, runs: dict, against: str) -> None:
    """Draw the objective of every run, in squares of the arm length, against "iteration" or "seconds"."""
    for name, run in runs.items():
        across = [getattr(record, against) for record in run["history"]]
        axes.semilogy(
            across, [record.objective for record in run["history"]], color=COLORS[name], lw=1.8, label=name
        )
    axes.set_xlabel("iteration" if against == "iteration" else "wall time [s]")
    axes.legend(frameon=False)


def draw_profile(axes, result: dict) -> None:
    """Draw every face's magnetization along its arm against the distance from the root, with that of beam theory."""
    star = result["design"]
    _, s = arm_coordinates(star.mesh.face_barycenters)
    along = 1e-3 * np.einsum("fi,fi->f", result["magnetization"], star.frames[:, 0].numpy())
    variables = from_beam_theory(star.mesh)[:, 0].numpy()
    beam = 1e-3 * CAP * variables / np.sqrt(1.0 + variables**2)
    order = np.argsort(s)
    axes.axhline(0.0, color=GREY, lw=0.6)
    axes.axvline(0.0, color=GREY, lw=0.6, ls=(0, (4, 3)))
    axes.plot(1e3 * s, along, ".", ms=3, color=BLUE, alpha=0.6, label="designed, every face")
    axes.plot(1e3 * s[order], beam[order], color=GREY, lw=1.2, label="beam theory, cut off")
    axes.set(xlabel="distance outwards from the root [mm]", ylabel="$M_r$ outwards along the arm [kA/m]")
    axes.legend(frameon=False, loc="lower left")


def summary(result: dict) -> str:
    star, best = result["design"], result["runs"]["from beam theory"]
    history = best["history"]
    chord, tip = result["chord_angles"], result["tip_angles"]
    reached = ", ".join(f"{np.degrees(angle):.1f}" for angle in chord["reached"])
    turned = ", ".join(f"{np.degrees(angle):.1f}" for angle in tip["reached"])
    heights = 1e3 * result["shaking"]["heights"]
    lines = [
        f"{star.mesh.n_faces} faces, {star.mesh.n_vertices} vertices, {3 * star.mesh.n_faces} variables, "
        f"{1e3 * FLUX_DENSITY:g} mT up and down",
        "",
        "objective            start        end   iterations   s an iteration   of it equilibria",
    ]
    for name, run in result["runs"].items():
        first, iterations = run["history"][0], run["history"][-1].iteration
        lines.append(
            f"{name:16s} {first.objective:9.3e}  {run['objective']:9.3e}   {iterations:10d}   "
            f"{run['seconds_per_iteration']:14.3f}   {run['share_of_equilibria']:16.0%}"
        )
    lines += [
        "",
        f"From the targets, by mass: {1e3 * result['rms']:.3f} mm (arms are {1e3 * ARM_LENGTH:.1f} mm long).",
        f"Plain sum of |x - x*|^2 over vertices and both cases: {result['plain_sum']:.3g} m2.",
        f"Arms' chords point down by {reached} deg; wanted {np.degrees(chord['wanted']):.1f}.",
        f"Faces at the tips turned by {turned} deg; wanted {np.degrees(tip['wanted']).mean():.1f}.",
        f"The hexagon is flat to {1e3 * result['hexagon_height']:.2f} mm.",
        f"|M_r| up to {1e-3 * result['largest_magnetization']:.1f} kA/m (cap {1e-3 * CAP:g}), "
        f"normal part up to {result['normal_magnetization']:.1e} A/m.",
        f"Up is down mirrored, to {result['mirror']:.1e} arm lengths.",
        f"Shaking: tips go between {heights.min():.1f} and {heights.max():.1f} mm; a turn closes to "
        f"{result['shaking']['not_closed']:.1e} arm lengths.",
        "",
        "[Chen22] Table 1: 2048 faces, 1097 vertices, 6 k variables, Y = 1e5 Pa, nu = 0.5; 50 iterations in",
        f"16000 s, 320 s each, on six cores. Here {star.mesh.n_faces} faces, {history[-1].iteration} iterations in "
        f"{history[-1].seconds:.0f} s. Their residual, 6.7e-2,",
        "cannot be compared: its unit, the star's size, the targets, field and start are not printed.",
    ]
    return "\n".join(lines)
