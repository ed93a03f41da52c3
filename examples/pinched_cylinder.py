"""How fine must a mesh be? Two shells under point forces are right to 0.1 % on meshes that refine themselves.

The deflection under a point force converges slowly, as the force bends the sheet most where it acts, and a thin cylinder
carries the rest far away. `ms.error_estimate` tells how wrong the deflection is and which elements are to blame;
`ms.refined_for` divides these and solves again, until the error is below a tolerance. Even meshes for the same error have
many times as many unknowns:

- the pinched cylinder, case B2 of `python -m benchmarks accuracy`, to first order;
- the hemisphere with a hole, case A4, with deflections of 0.8 radii.

The references are limits of Kirchhoff-Love theory. Both tables show the true error beside the estimated one.

Run it: prints a table and writes pictures into out/.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from _pinched.cases import CYLINDER, HEMISPHERE, Case
from _run import run

import magshell as ms

TOLERANCE = 1e-3  # [-] of the deflection
# The first mesh of each case, and even meshes beside it.
CYLINDER_CELLS = ((6, 6), (16, 16), (32, 32), (64, 64))
HEMISPHERE_CELLS = ((8, 8), (8, 8), (16, 16), (32, 32))


def main(cylinder=CYLINDER_CELLS, hemisphere=HEMISPHERE_CELLS, tolerance=TOLERANCE) -> dict[str, Any]:
    """Return the refined and the even meshes of both cases, with unknowns and errors.

    cylinder, hemisphere: cells of the mesh to be refined, then of the even ones; None leaves the case out.
    """
    chosen = ((CYLINDER, cylinder), (HEMISPHERE, hemisphere))
    return {
        "tolerance": tolerance,
        "cases": {case.name: measure(case, cells, tolerance) for case, cells in chosen if cells},
    }


def measure(case: Case, cells: tuple[tuple[int, int], ...], tolerance: float) -> dict[str, Any]:
    """Return the unknowns and relative errors of refined and even meshes, and of even meshes at the tolerance."""
    first, *even = cells
    start = case.solve(first)
    deflection = case.output(start)
    found = ms.refined_for(start, deflection, tolerance * case.exact, project=case.project)
    unknowns, errors = [], []
    for each in even:
        result = case.solve(each)
        unknowns.append(result.scene.n_dofs)
        errors.append(float(case.output(result)(result)) / case.exact - 1.0)
    return {
        "found": found,
        "exact": case.exact,
        "unknowns": found.n_dofs,
        "errors": found.values / case.exact - 1.0,
        "estimates": -found.errors / case.exact,
        "even unknowns": np.array(unknowns),
        "even errors": np.array(errors),
        "even unknowns at the tolerance": unknowns_for(tolerance, unknowns, np.abs(errors)),
    }


def unknowns_for(tolerance: float, unknowns: list[int], errors: np.ndarray) -> float:
    """Return the unknowns of an even mesh with this error, on the line through the last two in logarithms."""
    x, y = np.log(unknowns[-2:]), np.log(errors[-2:])
    return float(np.exp(x[1] + (np.log(tolerance) - y[1]) * (x[1] - x[0]) / (y[1] - y[0])))


def plot(result: dict[str, Any]):
    """Draw the errors against the unknowns, a panel for each case."""
    from matplotlib import pyplot as plt

    cases = result["cases"]
    figure, axes = plt.subplots(
        1, len(cases), figsize=(5.0 * len(cases), 4.0), layout="constrained", squeeze=False
    )
    for axis, (name, of) in zip(axes[0], cases.items(), strict=True):
        axis.loglog(of["even unknowns"], np.abs(of["even errors"]), "s-", color="#8a8f98", label="even mesh")
        axis.loglog(of["unknowns"], np.abs(of["errors"]), "o-", color="#c8553d", label="refined mesh")
        axis.loglog(of["unknowns"], np.abs(of["estimates"]), "+", color="black", label="its estimate")
        axis.axhline(result["tolerance"], color="black", linewidth=0.6, linestyle=":")
        axis.set(title=name, xlabel="unknowns", ylabel="relative error of the deflection")
        axis.legend()
    return figure


def picture(result: dict[str, Any]) -> ms.Picture:
    """Draw the last mesh of the first case."""
    return ms.plot(next(iter(result["cases"].values()))["found"].scene, style=ms.Style(mesh_lines=True))


def summary(result: dict[str, Any]) -> str:
    lines = []
    for name, of in result["cases"].items():
        rows = zip(of["unknowns"], of["errors"], of["estimates"], strict=True)
        lines += [f"{name}, refined: unknowns, error, estimate"]
        lines += [f"  {n:>8} {error:>+9.2%} {estimate:>+9.2%}" for n, error, estimate in rows]
        lines += ["even meshes: unknowns, error"]
        lines += [f"  {n:>8} {e:>+9.2%}" for n, e in zip(of["even unknowns"], of["even errors"], strict=True)]
        many = of["even unknowns at the tolerance"]
        lines += [
            f"even meshes need about {many:,.0f} unknowns for {result['tolerance']:.1%}, "
            f"the refined one {of['unknowns'][-1]:,}: {of['unknowns'][-1] / many:.1%} of them\n"
        ]
    return "\n".join(lines)


def write(outcome: dict[str, Any], out: Path) -> None:
    ms.Picture(plot(outcome)).save(out / "pinched_cylinder.png", dpi=200)
    picture(outcome).save(out / "pinched_cylinder_mesh.png")


if __name__ == "__main__":
    run(main, summary, write)
