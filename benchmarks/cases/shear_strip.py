"""Case A1: a cantilever strip under a dead transverse force at its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import magshell as ms

from .elastica import end_of_strip
from .outcome import Comparison, Outcome, mesh_name, order_of, outcome, sweep, tip

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 10.0, 1.0, 0.1, 1.2e6
FULL_LOAD = 4.0  # 4 EI / L^2, on the whole end

# P / FULL_LOAD: shortening U and deflection W of the end of an inextensible elastica under a dead end force,
# by elliptic integrals and by shooting, which agree. The case is that of Sze, Liu, Lo, Finite Elem. Anal.
# Des. 40 (2004) 1551, whose Abaqus S4R numbers lie within 0.0035 of these.
ELASTICA = {
    0.05: (0.026465, 0.663645),
    0.10: (0.103539, 1.309752),
    0.15: (0.224877, 1.923503),
    0.20: (0.381656, 2.494515),
    0.25: (0.564332, 3.017208),
    0.30: (0.764003, 3.490101),
    0.35: (0.973168, 3.914657),
    0.40: (1.185961, 4.294128),
    0.45: (1.398055, 4.632639),
    0.50: (1.606417, 4.934575),
    0.55: (1.809032, 5.204202),
    0.60: (2.004643, 5.445470),
    0.65: (2.192544, 5.661928),
    0.70: (2.372414, 5.856706),
    0.75: (2.544202, 6.032534),
    0.80: (2.708031, 6.191775),
    0.85: (2.864140, 6.336467),
    0.90: (3.012838, 6.468368),
    0.95: (3.154474, 6.588991),
    1.00: (3.289412, 6.699642),
}


def strip(
    cells: tuple[int, int], bending: str, seed: int = 0, irregular: float | None = 0.25
) -> ms.TriangleMesh | ms.QuadraticTriangleMesh:
    return ms.meshes.rectangle(LENGTH, WIDTH, cells, irregular=irregular, seed=seed, order=order_of(bending))


def shell(mesh: ms.TriangleMesh, bending: str) -> ms.Shell:
    return ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, bending=bending
    )


def scene(mesh: ms.TriangleMesh, bending: str) -> ms.Scene:
    """Return a scene clamped at x = 0, with the full load along z at its other end."""
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (0.0, 0.0, FULL_LOAD / WIDTH))
    return ms.Scene(shell(mesh, bending), supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])


def stretched_end() -> np.ndarray:
    """Return (W, U) of an extensible strip under the full load, which are 4e-6 and 4e-5 larger than those of the
    elastica."""
    stiffness = YOUNG_MODULUS * WIDTH * THICKNESS
    x, z = end_of_strip(LENGTH, stiffness, stiffness * THICKNESS**2 / 12.0, FULL_LOAD)
    return np.array((z, LENGTH - x))


def end_shear(
    cells: tuple[int, int] = (40, 4),
    bending: str = "midedge",
    *,
    irregular: float | None = 0.25,
    seed: int = 0,
    loads: Sequence[float] = tuple(ELASTICA),
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compute deflection and shortening of the end, against the exact elastica, at every load."""
    mesh = strip(cells, bending, seed, irregular)
    states = sweep(scene(mesh, bending), [{"load_factor": load} for load in loads], solver=solver)
    tips = [tip(mesh, state.displacements, x=LENGTH) for state in states]
    at = [f"P/Pmax = {load:g}" for load in loads]
    comparisons = [
        Comparison("W", [t[2] for t in tips], [ELASTICA[load][1] for load in loads], at=at, allowed=0.002),
    ]
    if loads[-1] == 1.0:
        comparisons.append(Comparison("U", -tips[-1][0], ELASTICA[1.0][0], at=at[-1:], allowed=0.003))
    return outcome(mesh_name(cells, irregular), mesh, comparisons, states)
