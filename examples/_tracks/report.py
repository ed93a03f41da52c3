"""The figure, and the summary that is printed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import magshell as ms

from .fits import METHODS, Fit
from .model import LIMIT, PAPER, TIME_STEP, Strip

RED, GREY = "#c8442d", "#777777"
COLORS = {"paper": "#8a5a9e", "spline": "#3f9c7a", "ours": "#20639b"}
COMPONENTS = {"x": "#20639b", "y": "#999999", "z": "#d98a1f"}


def draw_track(axes, strip: Strip, fit: Fit) -> None:
    """Draw the strip from its side at a few frames, and its tip at every one."""
    strobe = np.linspace(fit.task.first, fit.task.steps, 7).round().astype(int)
    for number, frame in enumerate((0, *strobe)):
        x, _, z = 1e3 * fit.positions[frame, strip.midline].T
        axes.plot(x, z, color=GREY, lw=1.4, alpha=0.3 + 0.09 * number, solid_capstyle="round")
    curve = 1e3 * fit.task.curve.at(np.linspace(0, 1, 401)).numpy()
    axes.plot(curve[:, 0], curve[:, 2], color=RED, lw=6, alpha=0.35, zorder=3)
    x, _, z = 1e3 * fit.track.T
    first, blue = fit.task.first, COLORS["ours"]
    axes.plot(x[: first + 1], z[: first + 1], "o", ms=1.6, color=blue, alpha=0.45, zorder=4)
    axes.plot(x[first:], z[first:], "o", ms=2.2, color=blue, zorder=5)
    axes.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", xlim=(-0.5, 31))


def draw_convergence(axes, fits: dict[str, Fit], name: str) -> None:
    for method, fit in fits.items():
        iterations, values = zip(
            *((record.iteration, record.objective) for record in fit.history), strict=True
        )
        axes.semilogy(iterations, values, color=COLORS[method], lw=1.6, label=METHODS[method].label)
    axes.axhline(PAPER[name]["residual"], color=RED, lw=1, ls=(0, (4, 2)))
    axes.text(
        0.98,
        PAPER[name]["residual"] * 1.15,
        f"paper, after {PAPER[name]['iterations']} (no unit printed)",
        color=RED,
        ha="right",
        fontsize=8,
        transform=axes.get_yaxis_transform(),
    )
    axes.set(xlabel="iteration", ylabel="objective [m$^2$]")
    axes.legend(frameon=False, fontsize=8)


def draw_field(axes, fits: dict[str, Fit]) -> None:
    """Draw the field of the last method in full lines, and that of the first faintly."""
    *_, smooth = fits.values()
    first = next(iter(fits.values()))
    for fit, style in ((first, {"lw": 0.9, "alpha": 0.35}), (smooth, {"lw": 1.8})):
        for index, (component, color) in enumerate(COMPONENTS.items()):
            values = 1e3 * fit.field[-fit.task.steps :, index]
            times = 1e3 * TIME_STEP * np.arange(1, fit.task.steps + 1)
            label = f"$B_{component}$" if fit is smooth else None
            axes.plot(times, values, color=color, label=label, **style)
    arrival = 1e3 * TIME_STEP * smooth.task.first
    axes.axvline(arrival, color=GREY, lw=0.8, ls=":")
    limit = 1e3 * LIMIT
    axes.text(arrival, 1.08 * limit, " at the curve's start", color=GREY, va="top", fontsize=8)
    axes.set(xlabel="time [ms]", ylabel="flux density [mT]", ylim=(-1.1 * limit, 1.1 * limit))
    axes.set_title(f"faint: {first.method.label}", loc="right", fontsize=8, color=GREY)
    axes.legend(frameon=False, fontsize=8, ncol=3, loc="lower left")


def summary(result: dict) -> str:
    lines = [
        "The paper prints residuals without a unit, nor sizes, weights or the strip's magnetization; here",
        "they are the weighted sum of squared distances [m2]. ms a step: of processor time, forward +",
        "backward. In mm: how far the tip is from the curve's start and end when it should be there, from",
        "the curve on average and at most; how far the track stays from some point of the curve; and the",
        "error in time: from the track by the third-order integrator with half the step, in the same field,",
        "at most.",
    ]
    for name, fits in result["fits"].items():
        paper = PAPER[name]
        lines += [
            "",
            f"{name}: the paper {paper['residual']:.1e} after {paper['iterations']} iterations of "
            f"{paper['seconds']:.0f} s; {paper['steps']} steps",
            f"  {'':30s}{'objective':>9s} {'iter.':>5s} {'s/iter.':>7s} {'ms a step':>9s}"
            f"{'start':>9s}{'end':>8s}{'mean':>8s}{'most':>8s}{'missed':>8s}{'in time':>8s}",
        ]
        lines += [_row(fit, result["costs"][name][method]) for method, fit in fits.items()]
    return "\n".join(lines)


def _row(fit: Fit, cost: dict[str, float]) -> str:
    figures = fit.figures
    steps = f"{cost['forward']:.1f} + {cost['backward']:.1f}"
    distances = [figures[name] for name in ("start", "end", "mean", "largest", "missed")]
    return (
        f"  {fit.method.label:30s}{figures['squares']:9.1e} {fit.history[-1].iteration:5d} {fit.seconds:7.2f} "
        f"{steps:>9s} " + "".join(f"{1e3 * distance:8.3f}" for distance in (*distances, fit.time_error))
    )


def states(strip: Strip, fit: Fit) -> ms.Picture:
    """Draw the strip in space: at rest, at the curve's start, halfway, at its end."""
    frames = [0, fit.task.first, (fit.task.first + fit.task.steps) // 2, fit.task.steps]
    times = ("at rest", "at the curve's start", "halfway", "at its end")
    return ms.plot(
        strip.scene.mesh,
        positions=fit.positions[frames],
        remanent_magnetization=strip.remanent_magnetization,
        applied_flux_density=[fit.field[-fit.task.steps :][max(0, frame - 1)] for frame in frames],
        titles=[
            f"{1e3 * TIME_STEP * frame:.0f} ms, {text}" for frame, text in zip(frames, times, strict=True)
        ],
        view=(16, -72),
        columns=4,
        width=2400,
    )


def movie(strip: Strip, fit: Fit, path: Path) -> Path:
    """Write the movie of the motion, fifty times slower."""
    flux_density = fit.field[-fit.task.steps :]
    return ms.animate(
        strip.scene.mesh,
        path,
        positions=fit.positions,
        times=TIME_STEP * np.arange(fit.task.steps + 1),
        remanent_magnetization=strip.remanent_magnetization,
        applied_flux_density=np.concatenate([flux_density[:1], flux_density]),
        speed=0.02,
        view=(16, -72),
        width=800,
        progress=False,
    )
