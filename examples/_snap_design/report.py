"""The figure, and the summary that is printed."""

from __future__ import annotations

import numpy as np

from .model import LENGTH, SHORTENING, THICKNESS

BLUE, RED, GREY = "#20639b", "#c8442d", "#777777"


def draw_paths(axes, result: dict) -> None:
    for name, color in (("before", GREY), ("after", BLUE)):
        curve = result[name]
        fields, heights = 1e3 * curve["fields"], 1e3 * curve["heights"]
        axes.plot(fields, heights, color=color, lw=1, ls=(0, (4, 2)))
        axes.plot(fields, np.where(curve["stable"], heights, np.nan), color=color, lw=2)
        axes.plot(1e3 * curve["snaps"], 1e3 * curve["heights of snaps"], "o", ms=5, color=color)
    for target in 1e3 * result["targets"]:
        axes.axvline(target, color=RED, lw=1, ls=":")
        axes.text(target, axes.get_ylim()[1], f" {target:.2f}", color=RED, va="top")
    axes.set(xlabel="flux density B [mT]", ylabel="height of mid-span [mm]", xlim=(-10, 16))
    axes.text(0.98, 0.85, "designed", color=BLUE, transform=axes.transAxes, ha="right")
    axes.text(0.98, 0.77, "uniform strip", color=GREY, transform=axes.transAxes, ha="right")


def draw_shapes(axes, result: dict) -> None:
    for name, color in (("before", GREY), ("after", BLUE)):
        curve = result[name]
        for shape, style in (("rest", "-"), ("limit", (0, (4, 2)))):
            x, z = 1e3 * curve[shape][:, 0], 1e3 * curve[shape][:, 2]
            axes.plot(x, z, color=color, ls=style, lw=2 if shape == "rest" else 1)
    axes.set(xlabel="x [mm]", ylabel="height [mm]", xlim=(0, 1e3 * LENGTH), ylim=(-0.8, None))
    axes.text(0.5, 0.02, "dashed: where it snaps", transform=axes.transAxes, ha="center")


def draw_search(axes, result: dict) -> None:
    misses = np.abs(result["fields"] - result["targets"]).max(axis=1)
    axes.semilogy(np.arange(1, len(misses) + 1), 1e3 * misses, "o-", color=BLUE, ms=4)
    axes.axhline(0.01, color=RED, lw=1, ls=":")
    axes.set(xlabel="paths", ylabel="largest miss [mT]")


def summary(result: dict) -> str:
    first, last = 1e3 * result["fields"][0], 1e3 * result["fields"][-1]
    shortening, mean, ratio, rotation = result["designs"][-1]
    lines = [
        f"A uniform strip snaps through at {first[0]:.3f} mT and back at {first[1]:.3f} mT.",
        f"The design, after {len(result['fields'])} paths, at {last[0]:.4f} mT and {last[1]:.4f} mT.",
        f"It is shortened by {1e3 * SHORTENING * np.exp(shortening):.4f} mm, {1e3 * THICKNESS * np.exp(mean):.4f} mm thick "
        f"on average, {100 * (np.exp(ratio) - 1):.2f} % thicker at the ends, and its clamps are rotated by "
        f"{np.degrees(rotation):.3f} degrees.",
        "Gradients of both fields [mT]:",
    ]
    for name, by in zip(result["names"], 1e3 * result["gradient"].T, strict=True):
        lines.append(f"  by the {name:<38}{by[0]:8.3f}{by[1]:8.3f}")
    for row in result["tried"]:
        done = "snaps" if row["snapped"] else "stays"
        lines.append(f"At {1e3 * row['field']:6.2f} mT it {done}: {1e3 * row['height']:.2f} mm high.")
    return "\n".join(lines)
