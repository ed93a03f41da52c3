"""Case A2: a cantilever strip rolled up into a full circle by a moment at its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import magshell as ms

from .outcome import Comparison, Outcome, mesh_name, order_of, outcome, sweep, tip

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 12.0, 1.0, 0.1, 1.2e6
FULL_MOMENT = 2.0 * np.pi * (YOUNG_MODULUS * WIDTH * THICKNESS**3 / 12.0) / LENGTH  # 2 pi EI / L: one turn
LOADS = tuple(k / 20 for k in range(1, 21))


def scene(mesh: ms.TriangleMesh, bending: str) -> ms.Scene:
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, bending=bending
    )
    couple = ms.EdgeCouple(mesh.edges_at(x=LENGTH), (0.0, -FULL_MOMENT / WIDTH, 0.0))
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[couple])


def exact(load: float) -> tuple[float, float]:
    """Return shortening and deflection of the end: the strip is an arc of the angle a = 2 pi M / Mmax."""
    a = 2.0 * np.pi * load
    return LENGTH * (1.0 - np.sin(a) / a), LENGTH * (1.0 - np.cos(a)) / a


def end_moment(
    cells: tuple[int, int] = (48, 4),
    bending: str = "midedge",
    *,
    irregular: float | None = None,
    loads: Sequence[float] = LOADS,
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compute deflection and shortening of the end, against the exact arc, at every load."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells, irregular=irregular, order=order_of(bending))
    # Beyond 0.928 Mmax the plane arc is unstable and bends sideways (on finer meshes too); the closed form is that of
    # the plane arc.
    load_parameters = [{"load_factor": load} for load in loads]
    states = sweep(scene(mesh, bending), load_parameters, require_stable=False, solver=solver)
    tips = np.array([tip(mesh, state.displacements, x=LENGTH) for state in states])
    references = np.array([exact(load) for load in loads])
    at = [f"M/Mmax = {load:g}" for load in loads]
    comparisons = [
        Comparison("U / L", -tips[:, 0] / LENGTH, references[:, 0] / LENGTH, at=at, scale=1.0, allowed=0.005),
        Comparison("W / L", tips[:, 2] / LENGTH, references[:, 1] / LENGTH, at=at, scale=1.0, allowed=0.005),
    ]
    return outcome(mesh_name(cells, irregular), mesh, comparisons, states)
