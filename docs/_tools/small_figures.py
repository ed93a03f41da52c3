"""Measures the counts and errors in the texts that no benchmark prints: python docs/_tools/small_figures.py [--json
FILE]."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

import magshell as ms
from benchmarks.cases import cylinder_roof, shear_strip
from benchmarks.cases.solids import SOLID_CASES, bent_beam
from benchmarks.statics import CASES, strongly_bent
from benchmarks.surrounding_costs import EXACT, SURROUNDINGS, TIME_STEP, falling

STEPS = 100  # time steps of the sheet of 768 faces that falls on a floor


def measure() -> dict[str, Any]:
    """Measure all numbers: returns {name: number}."""
    return {
        **_from_flat(),
        "factorizations after a change of 1 %": _warm_start(),
        "factorizations a point of a roof that snaps": _snap(),
        "falling": _falling(),
        "solids": _solids(),
        "stress of neo-Hookean densities, largest over smallest, %": 100.0
        * (_densities() - 1.0),
    }


def _from_flat() -> dict[str, Any]:
    """Count the factorizations of equilibria that start from the flat sheet."""
    found = {}
    for name, (build, controls, _) in CASES.items():
        found[name] = ms.equilibrium(build("midedge"), **controls).factorizations
    shear = shear_strip.scene(shear_strip.strip((40, 4), "midedge"), "midedge")
    plain = ms.equilibrium(shear, solver=ms.Newton(max_iterations=60))
    found["A1, plain Newton"] = plain.factorizations
    scene, controls = strongly_bent(2048)
    found["strongly bent"] = ms.equilibrium(scene, **controls).factorizations
    return {"factorizations from flat": found}


def _warm_start() -> int:
    """Count the factorizations of the strongly bent sheet from its own equilibrium in a field of one percent less."""
    scene, controls = strongly_bent(512)
    before = ms.equilibrium(scene, **controls)
    field = 1.01 * np.array(controls["applied_flux_density"])
    return ms.equilibrium(
        scene, start=before, **{**controls, "applied_flux_density": field}
    ).factorizations


def _snap() -> float:
    """Follow a roof through both limit points, with its critical points, and return the factorizations per point."""
    roof = cylinder_roof.scene(cylinder_roof.quarter((8, 8)), "midedge")
    path = ms.follow_path(roof, progress=False)
    return path.factorizations / len(path.positions)


def _falling() -> dict[str, float]:
    """Count the factorizations and iterations per step of a sheet that falls on a floor."""
    found = {}
    cases = [(name, each, ms.ImplicitEuler()) for name, each in SURROUNDINGS.items()]
    for name, each, integrator in [
        *cases,
        (f"{EXACT}, by default", SURROUNDINGS[EXACT], None),
    ]:
        move = ms.simulate(
            falling((48, 8), *each),
            steps=STEPS,
            time_step=TIME_STEP,
            remanent_magnetization=(2e4, 0, 1e3),
            applied_flux_density=lambda t: (
                5e-3 * np.cos(20 * t),
                0,
                5e-3 * np.sin(20 * t),
            ),
            integrator=integrator,
            record_every=STEPS,
            progress=False,
        )
        found[name] = {
            "factorizations": move.factorizations / STEPS,
            "iterations": move.iterations / STEPS,
        }
    return found


def _solids() -> dict[str, Any]:
    """Return the errors of Cook's membrane and of a bent beam [%], smallest and largest of each element."""
    found: dict[str, Any] = {}
    for case in SOLID_CASES:
        if case.name in ("T4a", "T6"):
            for element, cells in case.cells.items():
                run = case.run(cells, element)
                errors = [100.0 * each.error for each in run.comparisons]
                found[f"{case.name}, {element}"] = {
                    "least": min(errors),
                    "most": max(errors),
                    "unknowns": run.unknowns,
                    "iterations": run.iterations,
                }
    for cells, name in (((10, 1, 1), "one cell"), ((20, 2, 2), "two cells")):
        bent = bent_beam(cells, "linear").comparisons[0]
        found[f"share of a beam's deflection, {name}"] = 100.0 * float(
            bent.computed[0] / bent.reference[0]
        )
    return found


def _densities() -> float:
    """Compare the stress in a bar stretched to twice its length, nu = 0.3, of the densities called neo-Hookean."""
    mu, lam = 1.0 / 2.6, 0.3 / (1.3 * 0.4)
    bulk = lam + 2.0 * mu / 3.0
    densities = (
        lambda i, j: mu / 2 * (i - 3) - mu * np.log(j) + lam / 2 * np.log(j) ** 2,
        lambda i, j: mu / 2 * (i - 3) - mu * np.log(j) + lam / 2 * (j - 1) ** 2,
        lambda i, j: mu / 2 * (j ** (-2 / 3) * i - 3) + bulk / 2 * (j - 1) ** 2,
        lambda i, j: mu / 2 * (i - 3) - mu * (j - 1) + (lam + mu) / 2 * (j - 1) ** 2,
    )
    stresses = []
    for density in densities:

        def energy(along, across, density=density):
            return density(along**2 + 2 * across**2, along * across**2)

        def slope(f, at):
            return (f(at + 1e-6) - f(at - 1e-6)) / 2e-6

        across = brentq(lambda t: slope(lambda s: energy(2.0, s), t), 0.5, 1.2)
        stresses.append(slope(lambda s: energy(s, across), 2.0))  # noqa: B023
    return max(stresses) / min(stresses)


def main(arguments: list[str] | None = None) -> int:
    """Print the numbers as JSON, and write them where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write them there too"
    )
    options = parser.parse_args(arguments)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = measure()
    text = json.dumps(found, indent=1)
    print(text)
    if options.json:
        options.json.write_text(text + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
