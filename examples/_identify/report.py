"""The figure, and the summary that is printed."""

from __future__ import annotations

import io

import numpy as np

import magshell as ms

from .model import FIELDS, NOISE, true_magnetization

BLUE, RED, GREEN, GREY = "#20639b", "#c8442d", "#3d9970", "#777777"


def draw_modulus(axes, result: dict) -> None:
    """Draw Young's modulus, true and found, on the flat sheet."""
    from matplotlib import pyplot as plt

    problem = result["noisy"]["problem"]
    p = result["noisy"]["stages"][result["noisy"]["chosen"]]["p"]
    mesh, truth = problem.sheet.mesh, problem.sheet.scene.shell.young_modulus
    found = problem.decades(p).numpy()
    picture = ms.plot(
        mesh,
        positions=np.stack([mesh.rest_positions, mesh.rest_positions]),
        color=ms.Color([np.log10(truth) - 6, found - 6], label="log10 of Y [MPa]", range=(-0.1, 1.05)),
        titles=["true", "found"],
        view=(90, -90),
        width=1500,
    )
    axes.imshow(plt.imread(io.BytesIO(picture._repr_png_())), interpolation="lanczos")
    axes.set_axis_off()


def draw_history(axes, result: dict) -> None:
    """Draw the misfit against the number of equilibria solved so far, one stage for each price."""
    seen = 0
    for stage in result["noisy"]["stages"]:
        misfits = stage["misfits"]
        at = seen + np.linspace(1, stage["evaluations"], len(misfits))
        seen += stage["evaluations"]
        axes.plot(at, misfits, color=BLUE, lw=2)
        axes.axvline(seen, color=GREY, lw=0.5, ls=":")
        axes.text(at.mean(), 0.97, f"{stage['price']:g}", color=GREY, ha="center", va="top",
                  transform=axes.get_xaxis_transform())  # fmt: skip
    axes.axhline(1.0, color=RED, lw=1, ls="--")
    axes.text(1, 1.0, "the noise's own", color=RED, va="top")
    axes.set(
        yscale="log",
        xlabel="evaluations, with the price of variation above",
        ylabel="mean square misfit / noise²",
    )
    axes.set_ylim(0.6, None)


def draw_magnetization(axes, result: dict) -> None:
    """Draw each strip's components, with the standard deviations that the noise leaves."""
    problem = result["noisy"]["problem"]
    p = result["noisy"]["stages"][result["noisy"]["chosen"]]["p"]
    found, true = problem.magnetization(p).numpy(), true_magnetization()
    strips = np.arange(1, len(true) + 1)
    for k, (name, color) in enumerate((("x", BLUE), ("y", RED), ("z", GREEN))):
        places = strips + 0.2 * (k - 1)
        axes.bar(places, 1e-3 * true[:, k], 0.18, color=color, alpha=0.3)
        deviation = 1e-3 * result["deviations"]["magnetization"][:, k]
        axes.errorbar(
            places, 1e-3 * found[:, k], deviation, fmt="o", ms=4, color=color, capsize=2, label=name
        )
    axes.axhline(0.0, color=GREY, lw=0.8)
    axes.text(0.02, 0.02, "bars: true; points: found", color=GREY, transform=axes.transAxes)
    axes.set(xlabel="strip, from the clamp", ylabel="magnetization [kA/m]", xticks=strips)
    axes.legend(frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, 1.12))


def summary(result: dict) -> str:
    """Return the summary: errors of every stage, a comparison of optimizers, and the limits of identification."""
    lines = [
        f"Identification on {result['faces']} faces, {result['unknowns']} unknowns, {len(FIELDS)} load cases, "
        f"noise {1e3 * NOISE:g} mm",
        "                      price    misfit   log10 Y   Y, relative   median     M   evaluations  time [s]",
    ]
    for name in ("noisy", "exact", "same mesh"):
        stages = result[name]["stages"]
        for stage in stages if name == "noisy" else stages[-1:]:
            lines.append(
                f"  {name:<18}{stage['price']:7g}{stage['misfits'][-1]:10.4f}{stage['decades']:10.3f}"
                f"{stage['modulus']:14.1%}{stage['median']:9.1%}{stage['magnetization']:8.1%}"
                f"{stage['evaluations']:10d}{stage['seconds'][-1]:11.1f}"
            )
    lines.append("The last stage once more")
    for row in result["compared"]:
        lines.append(
            f"  {row['name']:<10}misfit {row['misfits'][-1]:.4f} after {len(row['misfits']) - 1} iterations, "
            f"{row['evaluations']} evaluations, {row['seconds'][-1]:.1f} s"
        )
    deviation = result["deviations"]
    lines += [
        "What the data cannot tell",
        f"  a factor common to Y and M: known to {deviation['common factor']:.2%} thanks to the weight",
        *(f"    twice of both moves a vertex by {1e3 * value:.2g} mm, {name}" for name, value in
          result["scaled together"].items()),
        f"  log10 Y at a node: {np.median(deviation['decades']):.2f} (median), were nothing known of its variation",
        f"  a component of M: {1e-3 * deviation['magnetization'].min():.1f} to "
        f"{1e-3 * deviation['magnetization'].max():.1f} kA/m",
        *(f"    on {row['strips'][0]} x {row['strips'][1]} regions {1e-3 * row['deviation']:.1f} kA/m at worst, "
          "Y being known" for row in result["finer magnetizations"]),
    ]  # fmt: skip
    found = result["intervals"]
    lines.append(
        f"  with Y known, {found['inside']} of {found['of']} intervals of ms.fit (95 %) hold the true component of M; "
        f"{found['fit'].minimum.history[-1].evaluations} evaluations"
    )
    return "\n".join(lines)
