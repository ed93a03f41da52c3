"""Design of a beam that snaps through at 8.00 mT and back at -5.00 mT, by gradients of critical fields.

The buckled magnetic beam of bistable_beam.py, with one clamp a quarter of a degree askew, snaps through at about 5 mT, and
back at about the opposite field. Four numbers are free: the shortening that buckles it, its mean thickness, the ratio of the
thickness at the ends to that in the middle, and a rotation of both clamps, which lifts the beam and makes its two shapes
differ. Each design takes one path through both limit points, and the gradients of their fields: `CriticalPoint.parameter`
is a tensor of the design. `ms.optim.GaussNewton` solves the two equations.

What comes out: four paths meet both fields within 0.01 mT. Gauss-Newton converges quadratically, as the gradients are exact.
Equilibria 0.05 mT below and above each field stay and snap, as designed. Most of the change is in the shortening, which
moves the fields apart, and in the rotation, which raises both.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from _run import run
from _snap_design.model import NAMES, SIZES, Beam
from _snap_design.report import draw_paths, draw_search, draw_shapes, summary

import magshell as ms

TARGETS = (8.00e-3, -5.00e-3)  # T
CLOSE = 1e-6  # T, where the search ends
MOST_PATHS = 10
ASIDE = 0.05e-3  # T, below and above the designed fields, where the design is tried


def main(cells=(48, 8)) -> dict:
    """Return the figure's numbers, in SI units."""
    beam = Beam(cells)
    searched = search(beam)
    first, last = searched["designs"][0], searched["designs"][-1]
    return {
        "cells": cells,
        "targets": np.array(TARGETS),
        "names": NAMES,
        **searched,
        "gradient": gradient(beam, last),
        "before": curve(beam, first),
        "after": curve(beam, last),
        "tried": tried(beam, last),
        "beam": beam,
    }


def search(beam: Beam) -> dict:
    """Search the design with both targets; return all designs (n, 4) that were tried, and their fields (n, 2)."""
    design = torch.zeros(4, dtype=torch.float64, requires_grad=True)
    designs, fields = [], []

    def misses(design: torch.Tensor) -> torch.Tensor:
        found = beam.snaps(design).fields()
        designs.append(design.detach().numpy().copy())
        fields.append(found.detach().numpy().copy())
        return 1e3 * (found - torch.tensor(TARGETS))  # mT

    optimizer = ms.optim.GaussNewton([design], scale=torch.tensor(SIZES), max_evaluations=MOST_PATHS)
    ms.minimize(
        misses,
        [design],
        optimizer,
        max_iterations=MOST_PATHS,
        progress=False,
        callback=lambda record: record.objective < 0.5 * (1e3 * CLOSE) ** 2,
    )
    return {"designs": np.array(designs), "fields": np.array(fields)}


def gradient(beam: Beam, design: np.ndarray) -> np.ndarray:
    """Return the derivatives of both fields by the design, (2, 4) T."""
    x = torch.tensor(design, requires_grad=True)
    return np.array(
        [torch.autograd.grad(each, x, retain_graph=True)[0].numpy() for each in beam.snaps(x).fields()]
    )


def curve(beam: Beam, design: np.ndarray) -> dict:
    """Return fields [T], heights of mid-span [m] and stability along the path of a design, and two of its shapes [m]."""
    x = torch.tensor(design)
    snaps = beam.snaps(x, max_step=0.003)
    path, points = snaps.path, [point.after_point + 1 for point in snaps.path.critical]
    heights = [point.positions[beam.middle, 2] for point in path.critical]
    limits = snaps.fields().numpy()
    return {
        "fields": np.insert(path.applied_flux_densities[:, 2], points, limits),
        "heights": np.insert(path.positions[:, beam.middle, 2], points, heights),
        "stable": np.insert(path.stable, points, True),
        "snaps": limits,
        "heights of snaps": np.array(heights),
        "rest": path.positions[0, beam.line],
        "limit": path.critical[0].positions[beam.line].numpy(),
    }


def tried(beam: Beam, design: np.ndarray) -> list[dict]:
    """Return whether equilibria just below and above each target have snapped, by their heights [m]."""
    x = torch.tensor(design)
    up = beam.at_rest(x)
    down = beam.at_rest(x, 1.5 * TARGETS[0], start=up)
    rows = []
    for target, start in zip(TARGETS, (up, down), strict=True):
        for field in (target - np.sign(target) * ASIDE, target + np.sign(target) * ASIDE):
            rest = beam.at_rest(x, field, start=start)
            rows.append(
                {
                    "field": float(field),
                    "from": beam.height(start),
                    "height": beam.height(rest),
                    "snapped": bool(np.sign(beam.height(rest)) != np.sign(beam.height(start))),
                }
            )
    return rows


def plot(result: dict):
    """Draw the heights of both beams over the field, their shapes, and the search."""
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(
        1, 3, figsize=(11, 3.8), width_ratios=(1.6, 1, 1), layout="constrained"
    )
    draw_paths(left, result)
    draw_shapes(middle, result)
    draw_search(right, result)
    for axes, letter in ((left, "a"), (middle, "b"), (right, "c")):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "snap_design.png", dpi=200)


if __name__ == "__main__":
    run(main, summary, write)
