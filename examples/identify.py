"""Identification of a sheet's Young's modulus and magnetization from the positions of its vertices in three fields.

A strip of 50 x 30 x 1 mm, clamped at one end, hangs in fields of 20 mT along z, x and y, and in none. Its modulus
varies smoothly from 1 to 2.5 MPa, with an inclusion of 10 MPa; its five strips are magnetized each in a direction of
its own. Positions are known to 0.1 mm (standard deviation of each coordinate), from a mesh with eight times as many
faces as the one that they are explained with.

Unknown are log Y at nodes 5 mm apart and the three components of M in each strip: 92 numbers. Minimized is the mean
square misfit, in units of the noise, plus a price on the total variation of log Y. The price is lowered until the
misfit is what the noise alone would leave, 1, and no further (the discrepancy principle).

What comes out: log10 Y to 0.10 on average (28 % of Y, half of the faces within 12 %) and M to 8 %; from exact data
to 0.04 (12 %, 6 %) and 4 %, which the coarser mesh, the bilinear modulus and the last price leave. Data from the same
mesh, the inverse crime, do no better: at this noise the noise decides. What it teaches:

- Without its weight the sheet would tell Y and M only up to a common factor: twice of both leaves every vertex where
  it is, to 1e-13 mm. Gravity, with a known density, is the known load that sets the scale, to 0.02 %.
- In-plane magnetization is felt through its poles, the jumps of its normal component: a sheet that hardly stretches
  does not notice what has none. Five strips tell their M to a few kA/m; fifteen squares, with the same data, leave
  one of their components open by 66 kA/m, though Y be known.
- The noise leaves log10 Y at a node open by 0.9 if nothing else is known: the price of variation is knowledge too,
  and it flattens the inclusion. The error bars, which are without it, are not to be trusted where it decides.
- `ms.fit` gives the 15 numbers of the strips with intervals, Y being known: 95 % of them should contain the truth.
- Half of the work is in the variables. In those of about equal effect on the data (`whitened`) L-BFGS takes tens of
  iterations; in the modulus of every face, 800 were not enough. MMA, which takes each variable by itself, has come
  to 0.996 after 40 iterations where L-BFGS is at 0.987 after 10.

Run it: prints a summary and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from _identify.inverse import Problem, lbfgs, mma, optimized, whitened
from _identify.limits import deviations, intervals, of_finer_magnetizations, scaled_together
from _identify.model import NOISE, measured, sheet, true_magnetization
from _identify.report import draw_history, draw_magnetization, draw_modulus, summary
from _run import run

import magshell as ms

PRICES = (1.0, 0.3, 0.1, 0.03, 0.01)


def main(cells=(30, 18), nodes=(11, 7), prices=PRICES, iterations=40, limits_on=(20, 12)) -> dict:
    """Return the figure's numbers, in SI units."""
    torch.set_num_threads(1)
    noisy = identified(cells, nodes, prices, iterations, NOISE)
    first, chosen = noisy["stages"][0], noisy["stages"][noisy["chosen"]]
    problem = noisy["problem"]
    searched = problem, chosen["start"], chosen["basis"], chosen["price"]
    return {
        "cells": cells,
        "faces": problem.sheet.mesh.n_faces,
        "unknowns": len(chosen["p"]),
        "noisy": noisy,
        "exact": identified(cells, nodes, prices, iterations, 0.0, first["basis"]),
        "same mesh": identified(cells, nodes, prices, iterations, NOISE, first["basis"], same_mesh=True),
        "deviations": deviations(problem, chosen["p"]),
        "compared": [{"name": "L-BFGS", **chosen}, {"name": "MMA", **optimized(*searched, mma, iterations)}],
        "intervals": intervals(limits_on),
        "scaled together": scaled_together(limits_on),
        "finer magnetizations": of_finer_magnetizations(limits_on),
    }


def identified(cells, nodes, prices, iterations, noise, basis=None, same_mesh=False) -> dict:
    """Lower and lower prices, each from the last one's result, until the misfit is the noise's; exact data, all.

    basis: of the variables of the first search, if it is known; it depends on the guess, but not on the data.
    """
    problem = Problem(sheet(cells), measured(cells, noise, same_mesh), NOISE, nodes)
    p, stages = problem.guess(), []
    for price in prices:
        if stages or basis is None:
            basis = whitened(problem.sensitivity(p))
        stage = optimized(problem, p, basis, price, lbfgs, iterations)
        p = stage["p"]
        stages.append({**stage, **errors(problem, p)})
        if noise > 0 and stage["misfits"][-1] <= 1.0:
            break
    return {"problem": problem, "stages": stages, "chosen": len(stages) - 1}


def errors(problem: Problem, p: torch.Tensor) -> dict:
    """Compute the errors against the truth.

    They are the root mean square errors of log10 Y, of Y and of M (both relative), weighted by area, and the median
    of Y's.
    """
    mesh = problem.sheet.mesh
    shares = mesh.face_areas / mesh.face_areas.sum()
    truth, found = problem.sheet.scene.shell.young_modulus, 10 ** problem.decades(p).numpy()
    magnetization, true = problem.magnetization(p).numpy(), true_magnetization()
    return {
        "decades": float(np.sqrt(shares @ np.log10(found / truth) ** 2)),
        "modulus": float(np.sqrt(shares @ (found - truth) ** 2 / (shares @ truth**2))),
        "median": float(np.median(np.abs(found / truth - 1))),
        "magnetization": float(np.linalg.norm(magnetization - true) / np.linalg.norm(true)),
    }


def plot(result: dict):
    """Draw the modulus, the misfit during the search, and the magnetization with the true one."""
    from matplotlib import pyplot as plt

    figure = plt.figure(figsize=(10, 7.6), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.25, 1))
    above = top.subplots()
    left, right = bottom.subplots(1, 2)
    draw_modulus(above, result)
    draw_history(left, result)
    draw_magnetization(right, result)
    for axes, letter in ((above, "a"), (left, "b"), (right, "c")):
        axes.set_title(letter, loc="left", fontweight="bold")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def write(outcome: dict, out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "identify.png", dpi=200)


if __name__ == "__main__":
    run(main, summary, write)
