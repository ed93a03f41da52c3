"""The figure of examples/kirigami_reaching.py, and the summary that is printed."""

from __future__ import annotations

import io

import numpy as np

import magshell as ms

from .reaching import FIELD_LIMIT

FOUND, START, GREY = "#20639b", "#c8442d", "#777777"
LABELS = {"start": "field pointing to the target", "found": "found", "finer": "found, in steps of 1 ms"}
PAPER = {
    "iterations": 486,
    "seconds": 4.1e4,
    "residual": 4.9e-4,
}  # [Chen22] Table 1, six cores, unit not given


def draw_distances(axes, result: dict) -> None:
    """Draw the distance to the active target, with dots one delay after each appears and bands where it counts."""
    times = result["times"]
    for k, begin in enumerate(result["begin"]):
        end = begin + result["each"]
        axes.axvspan(begin + result["delay"], end, color=GREY, alpha=0.12, lw=0)
        axes.axvline(begin, color=GREY, lw=0.8, ls=":")
        axes.text(begin + 0.03, 1.02, f"target {k + 1}", color=GREY, transform=axes.get_xaxis_transform())
    for name, color in (("start", START), ("found", FOUND)):
        axes.semilogy(times, 1e3 * result[name]["distances"], color=color, lw=1.6, label=LABELS[name])
    marked = result["begin"] + result["delay"]
    for when, distance in zip(marked, result["found"]["after"], strict=True):
        axes.plot(when, 1e3 * distance, "o", color=FOUND, ms=5)
        axes.annotate(
            f"{1e3 * distance:.2f} mm",
            (when, 1e3 * distance),
            xytext=(-6, -4),
            textcoords="offset points",
            color=FOUND,
            ha="right",
            va="top",
        )
    axes.set(ylabel="distance [mm]", xlim=(0, times[-1]))
    axes.legend(frameon=False, loc="lower right", ncols=2, bbox_to_anchor=(1.0, 1.08))


def draw_angles(axes, result: dict) -> None:
    for name, color in (("start", START), ("found", FOUND)):
        axes.plot(result["times"][1:], np.degrees(result[name]["angles"]), color=color, lw=1.6)
    for begin in result["begin"]:
        axes.axvline(begin, color=GREY, lw=0.8, ls=":")
    axes.set(ylabel="field to target [degrees]", ylim=(0, None), xlim=(0, result["times"][-1]))


def draw_field(axes, result: dict) -> None:
    for k, (name, color) in enumerate(zip("xyz", ("#3d9970", "#b07aa1", "#333333"), strict=True)):
        axes.plot(
            result["times"][1:],
            1e3 * result["found"]["field"][:, k],
            color=color,
            lw=1.4,
            label=f"$B_{name}$",
        )
    for begin in result["begin"]:
        axes.axvline(begin, color=GREY, lw=0.8, ls=":")
    for bound in (-1e3 * FIELD_LIMIT, 1e3 * FIELD_LIMIT):
        axes.axhline(bound, color=GREY, lw=0.8)
    axes.set(xlabel="time [s]", ylabel="B [mT]", xlim=(0, result["times"][-1]))
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def draw_towers(axes, result: dict) -> None:
    """Draw the tower one delay after each target appeared, with the target's position in the titles."""
    from matplotlib import pyplot as plt

    frames, targets = result["marked_frames"], result["targets"]
    positions = [result["found"]["positions"][frame] for frame in frames]
    picture = ms.plot(
        [ms.TriangleMesh(each, result["mesh"].faces) for each in positions],
        color=ms.Color(
            [1e3 * each[:, 2] for each in positions], label="height [mm]", range=(0.0, 1e3 * result["height"])
        ),
        titles=[
            f"target {k + 1}: ({x:.0f}, {y:.0f}, {z:.0f}) mm" for k, (x, y, z) in enumerate(1e3 * targets)
        ],
        columns=len(frames),
        view=(12, -60),
        width=2000,
    )
    axes.imshow(plt.imread(io.BytesIO(picture._repr_png_())), interpolation="lanczos")
    axes.set_axis_off()


def movie(result: dict, path) -> None:
    """Write the movie of the motion with the field's arrow, in real time."""
    frames = slice(None, None, 4)
    fields = np.vstack([result["found"]["field"][:1], result["found"]["field"]])
    ms.animate(
        result["mesh"],
        path,
        positions=result["found"]["positions"][frames],
        times=result["times"][frames],
        applied_flux_density=fields[frames],
        color=None,
        view=(12, -60),
        width=700,
        title="Kirigami reaching four targets",
        progress=False,
    )


def summary(result: dict) -> str:
    """Return the summary: distances from the targets, and the cost of the search."""
    rows = []
    for name in ("start", "found", "finer"):
        each = result[name]
        after = "  ".join(f"{1e3 * distance:6.3f}" for distance in each["after"])
        rows.append(
            f"  {LABELS[name]:<32}{after}   {1e3 * each['rms']:7.3f} {1e3 * each['largest']:8.3f}"
            f"   {each['sum_of_squares']:.2e}   {each['halved']:4d}"
        )
    an_iteration = result["seconds"] / result["iterations"]
    angles = np.degrees(result["found"]["angles"])
    return "\n".join(
        (
            f"Kirigami reaching {len(result['targets'])} targets, {result['mesh'].n_faces} faces, "
            f"{len(result['times']) - 1} steps",
            f"  distance [mm]                   {result['delay']:g} s after each appears          while it counts: rms,"
            " largest, sum of squares [m2]; steps in parts",
            *rows,
            f"  {result['variables']} variables, {result['iterations']} iterations, {result['evaluations']} evaluations,"
            f" {result['seconds']:.0f} s, {an_iteration:.1f} s each ({result['reason']})",
            f"  forward {result['forward']:.2f} s, backward {result['backward']:.2f} s",
            f"  field to target: {angles.mean():.1f} degrees on average, {angles.max():.1f} at most",
            f"  [Chen22] Table 1: residual {PAPER['residual']} in a unit not given, {PAPER['iterations']} iterations, "
            f"{PAPER['seconds'] / PAPER['iterations']:.0f} s each on six cores",
        )
    )
