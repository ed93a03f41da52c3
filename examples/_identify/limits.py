"""The limits of identification: parameters that positions cannot determine, however well they are measured."""

from __future__ import annotations

import numpy as np
import torch

import magshell as ms

from .inverse import UNIT, Problem
from .model import FIELDS, NOISE, measured, sheet, true_magnetization


def scaled_together(cells, factor: float = 2.0) -> dict:
    """Return how far vertices move [m] when modulus and magnetization are both multiplied, without weight and with
    it.
    """
    moved = {}
    for name, weight in (("weightless", False), ("with weight", True)):
        whole = sheet(cells, weight=weight)
        modulus, magnetization = whole.scene.shell.young_modulus, true_magnetization()[whole.regions]
        shapes = [
            ms.equilibrium(
                whole.scene,
                young_modulus=k * modulus,
                remanent_magnetization=k * magnetization,
                applied_flux_density=FIELDS,
            ).positions
            for k in (1.0, factor)
        ]
        moved[name] = float(np.abs(shapes[1] - shapes[0]).max())
    return moved


def deviations(problem: Problem, p: torch.Tensor) -> dict:
    """Return the standard deviations that the noise leaves, to first order and without a prior.

    They are those of log10 Y at each node, of the magnetization [A/m], and of a factor common to Y and M.
    """
    sensitivity = problem.sensitivity(p)
    variances = np.diag(np.linalg.inv(sensitivity.T @ sensitivity))
    common = torch.cat([torch.ones(problem.n_nodes), np.log(10) * p[problem.n_nodes :]]).numpy()
    return {
        "decades": np.sqrt(variances[: problem.n_nodes]),
        "magnetization": UNIT * np.sqrt(variances[problem.n_nodes :]).reshape(-1, 3),
        "common factor": float(np.log(10) / np.linalg.norm(sensitivity @ common)),
    }


def intervals(cells, level: float = 0.95) -> dict:
    """Fit the magnetization of each strip with its intervals [A/m], Y being known, to noisy positions of the same
    mesh.
    """
    whole = sheet(cells)
    solve = ms.WarmStart(whole.scene)

    def positions(magnetization):
        rows = ms.parametrize.from_regions(magnetization, whole.regions)
        return solve(remanent_magnetization=rows, applied_flux_density=FIELDS).positions

    fitted = ms.fit(
        positions,
        measured(cells, NOISE, same_mesh=True),
        {"magnetization": ms.FitParameter(np.zeros_like(true_magnetization()), size=UNIT, unit="A/m")},
        noise=NOISE,
        level=level,
        progress=False,
    )
    inside = (fitted.lower["magnetization"] < true_magnetization()) & (
        true_magnetization() < fitted.upper["magnetization"]
    )
    return {"fit": fitted, "inside": int(inside.sum()), "of": inside.size}


def of_finer_magnetizations(cells, divisions=((5, 1), (10, 1), (5, 3))) -> list[dict]:
    """Return the largest standard deviation [A/m] of a component of M for finer divisions into regions, Y being
    known.
    """
    rows = []
    for strips in divisions:
        whole = sheet(cells, strips=strips)
        finest = sheet(cells).regions
        magnetization = np.empty((whole.n_regions, 3))
        magnetization[whole.regions] = true_magnetization()[finest]
        loads = {"applied_flux_density": FIELDS}
        base = ms.equilibrium(whole.scene, remanent_magnetization=magnetization[whole.regions], **loads)
        columns = []
        for k in range(magnetization.size):
            moved = magnetization.copy()
            moved.flat[k] += 500.0
            there = ms.equilibrium(
                whole.scene, remanent_magnetization=moved[whole.regions], start=base, **loads
            )
            columns.append((there.positions - base.positions).ravel() / (500.0 * NOISE))
        sensitivity = np.stack(columns, axis=1)
        worst = np.sqrt(np.diag(np.linalg.inv(sensitivity.T @ sensitivity))).max()
        rows.append({"strips": strips, "deviation": float(worst)})
    return rows
