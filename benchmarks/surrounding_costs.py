"""Cost of contact, friction and water per time step: one sheet that falls on a floor in a rotating field."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import magshell as ms

from .ratios import note
from .report import print_table

CELLS, QUICK_CELLS = ((48, 8), (128, 32)), ((6, 2),)
TIME_STEP, STEPS, QUICK_STEPS = 1e-3, 100, 20
ALLOWED = 2.5  # [-] largest time of a step over one without contact
EXACT = "contact, friction"
EULER = ms.ImplicitEuler()
SURROUNDINGS: dict[
    str, tuple[dict[str, Any] | None, bool]
] = {  # (friction in keywords for ms.Contact, or None without contact; whether in water)
    "none": (None, False),
    "water": (None, True),
    "contact": ({}, False),
    "contact, lagged friction": ({"friction_coefficient": 0.6, "lagged_friction": True}, False),
    EXACT: ({"friction_coefficient": 0.6}, False),
    "contact, friction, water": ({"friction_coefficient": 0.6}, True),
}


def falling(cells: tuple[int, int], friction: dict[str, Any] | None, in_water: bool) -> ms.Scene:
    """Return a soft sheet, 12 cm x 2 cm, 1 mm above the floor if there is one."""
    mesh = ms.meshes.rectangle(0.12, 0.02, cells=cells, irregular=0.2)
    sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e5, mass_density=1e3)
    floor = ms.obstacles.Plane(center=(0, 0, -1e-3))
    return ms.Scene(
        sheet,
        contacts=[] if friction is None else [ms.Contact(floor, **friction)],
        water=ms.Water() if in_water else None,
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
        allow_rigid_motions=True,
    )


def measure(rounds: int, quick: bool) -> dict[str, Any]:
    """Print the tables of steps of implicit Euler.

    Returns {faces: {surroundings: {"step" [s], "iterations", "halved", "way" [m]}}}.
    """
    results, steps = {}, QUICK_STEPS if quick else STEPS
    for cells in QUICK_CELLS if quick else CELLS:
        rows = {name: _motion(falling(cells, *each), steps, rounds) for name, each in SURROUNDINGS.items()}
        faces = 2 * cells[0] * cells[1]
        results[faces] = rows
        free = rows["none"]["step"]
        print_table(
            f"A sheet of {faces} faces that falls on a floor: a step of implicit Euler",
            ["surroundings", "ms", "times none", "iterations", "in parts", "way along the floor / mm"],
            [
                [
                    name,
                    f"{1e3 * row['step']:.2f}",
                    f"{row['step'] / free:.2f}",
                    f"{row['iterations']:.1f}",
                    str(row["halved"]),
                    f"{1e3 * row['way']:.4f}",
                ]
                for name, row in rows.items()
            ],
        )
        ratio = rows[EXACT]["step"] / free
        missed = ""
        for name, row in rows.items():
            note("count", f"{name}, {faces} faces: iterations of {steps} steps", row["iterations"] * steps)
            if name != "none":
                allowed = ALLOWED if name == EXACT else None
                title = f"{name}, {faces} faces: a step over one without"
                missed += note("share", title, row["step"] / free, at_most=allowed)
        print(f"With contact and friction {ratio:.2f} times a step without (at most {ALLOWED:g}){missed}.")
    return results


def _motion(
    scene: ms.Scene, steps: int, rounds: int, integrator: ms.ImplicitEuler | None = EULER
) -> dict[str, Any]:
    best = np.inf
    for _ in range(rounds):
        began = time.process_time()
        move = ms.simulate(
            scene,
            steps=steps,
            time_step=TIME_STEP,
            remanent_magnetization=(2e4, 0, 1e3),
            applied_flux_density=lambda t: (5e-3 * np.cos(20 * t), 0, 5e-3 * np.sin(20 * t)),
            integrator=integrator,
            record_every=steps,
            progress=False,
        )
        best = min(best, time.process_time() - began)
    return {
        "step": best / steps,
        "iterations": move.iterations / steps,
        "halved": len(move.substeps),
        "way": float(move.displacements[-1, :, 0].mean()),
    }
