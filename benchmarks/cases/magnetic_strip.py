"""Cases C1-90, C1-180 and C4: a cantilever strip magnetised along its length, in a uniform field."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import magshell as ms

from . import shear_strip
from .elastica import end_of_strip
from .outcome import Comparison, Outcome, mesh_name, order_of, outcome, sweep, tip

LENGTH, WIDTH, YOUNG_MODULUS, MAGNETIZATION = 0.1, 0.01, 1e6, 1e5
THICKNESS = LENGTH / 400  # thin, so that the strip stretches by only 1e-5: the elastica is inextensible

# beta = M B A L^2 / (EI): end (x, y) / L of the hard-magnetic elastica
#
#   EI theta'' + M A B sin(phi - theta) = 0,   theta(0) = theta'(L) = 0,   phi the angle of the field
#
# by elliptic integrals and by shooting, which agree to 5e-14.
ACROSS = {  # phi = 90 degrees
    0.5: (0.9840810375291625, 0.1621435756583696),
    1.0: (0.9435667637166231, 0.30172077379981355),
    1.5: (0.8920584993164408, 0.410978211248258),
    2.0: (0.8393582791748327, 0.49345748039671183),
    2.5: (0.790041542629265, 0.5556594626608021),
    3.0: (0.7455798154358129, 0.6032534411299774),
    4.0: (0.671058757753154, 0.6699641812776668),
    5.0: (0.6123716392755701, 0.7137915236119128),
    7.5: (0.5104257514768928, 0.7767020004430666),
    10.0: (0.4450044022462487, 0.8106090248802964),
    15.0: (0.3647142196379147, 0.8477156743322971),
    20.0: (0.3161144324335249, 0.8686958982854378),
}
AGAINST = {  # phi = 180 degrees; the straight state is stable up to beta = pi^2 / 4 = 2.467
    2.5: (0.9739635267692205, 0.20376920056591263),
    2.6: (0.8986594809001192, 0.392277528512775),
    3.0: (0.6531780573992787, 0.6636293494490895),
    4.0: (0.274180186897619, 0.802406517388633),
    5.0: (0.059784479045601316, 0.7952172458706069),
    7.5: (-0.21110202301847417, 0.7037978682735176),
    10.0: (-0.3425503545188661, 0.6230221778802661),
    15.0: (-0.4775107369037413, 0.5145898819504375),
    20.0: (-0.5509249421294047, 0.4467448193813692),
}


def scene(mesh: ms.TriangleMesh, bending: str) -> ms.Scene:
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, bending=bending
    )
    return ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())


def stretched_end(beta: float) -> np.ndarray:
    """Return the end (x, y) / L of an extensible strip in a field across it: that under a dead force M B A."""
    stiffness = YOUNG_MODULUS * WIDTH * THICKNESS
    bending = stiffness * THICKNESS**2 / 12.0
    return end_of_strip(LENGTH, stiffness, bending, beta * bending / LENGTH**2) / LENGTH


def _strip(
    cells, bending: str, irregular: float | None, seed: int
) -> ms.TriangleMesh | ms.QuadraticTriangleMesh:
    return ms.meshes.rectangle(LENGTH, WIDTH, cells, irregular=irregular, seed=seed, order=order_of(bending))


def load_parameters(beta: float, direction: tuple[float, float, float]) -> dict[str, Any]:
    """Return the load parameters: magnetised along x, in the field [T] along `direction` that gives beta."""
    flux_density = beta * YOUNG_MODULUS * THICKNESS**2 / (12.0 * MAGNETIZATION * LENGTH**2)
    return {
        "remanent_magnetization": (MAGNETIZATION, 0.0, 0.0),
        "applied_flux_density": flux_density * np.array(direction),
    }


def field_across(
    cells: tuple[int, int] = (80, 8),
    bending: str = "midedge",
    *,
    irregular: float | None = 0.25,
    seed: int = 0,
    betas: Sequence[float] = tuple(ACROSS),
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compute case C1-90: the end of the strip against the elastica, at every beta."""
    mesh = _strip(cells, bending, irregular, seed)
    references = {beta: ACROSS[beta] for beta in betas}
    return _against_elastica(mesh_name(cells, irregular), mesh, bending, references, (0.0, 0.0, 1.0), solver)


def field_against(
    cells: tuple[int, int] = (80, 8),
    bending: str = "midedge",
    *,
    irregular: float | None = 0.25,
    seed: int = 0,
    betas: Sequence[float] = tuple(AGAINST),
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compute case C1-180: as C1-90 in an opposite field, past the critical one, where the straight strip is a saddle
    point."""
    mesh = _strip(cells, bending, irregular, seed)
    references = {beta: AGAINST[beta] for beta in betas}
    return _against_elastica(mesh_name(cells, irregular), mesh, bending, references, (-1.0, 0.0, 0.0), solver)


def _against_elastica(
    name: str, mesh, bending: str, references: dict[str, Any], direction, solver
) -> Outcome:
    states = sweep(
        scene(mesh, bending), [load_parameters(beta, direction) for beta in references], solver=solver
    )
    tips = np.array([tip(mesh, state.positions, x=LENGTH) for state in states]) / LENGTH
    x, y = np.array(list(references.values())).T
    at = [f"beta = {beta:g}" for beta in references]
    comparisons = [
        Comparison("x / L", tips[:, 0], x, at=at, scale=1.0, allowed=0.001),
        Comparison("y / L", np.abs(tips[:, 2]), y, at=at, scale=1.0, allowed=0.001),
    ]
    return outcome(name, mesh, comparisons, states)


def magnetic_end_shear(
    cells: tuple[int, int] = (40, 4), bending: str = "midedge", *, seed: int = 0
) -> Outcome:
    """Compute case C4: the strip of A1, magnetised along x in a field along z, deflects as under a dead force at its
    end.

    For a tangential uniform M and a uniform B the magnetic energy is the work of the dead traction h (M . nu)
    B on the boundary (divergence theorem), nu its outward normal: here the end load P = h w M B.
    """
    mesh = shear_strip.strip(cells, bending, seed)
    magnetic = _sheared_by_a_field(mesh, bending)
    loaded = ms.equilibrium(shear_strip.scene(mesh, bending))
    ends = [tip(mesh, state.displacements, x=shear_strip.LENGTH) for state in (magnetic, loaded)]
    comparisons = [
        Comparison(f"{name}, field = force", ends[0][axis], ends[1][axis], allowed=0.001)
        for name, axis in (("W", 2), ("U", 0))
    ]
    return outcome(f"irregular {mesh_name(cells)}", mesh, comparisons, [magnetic, loaded])


def shear_against_elastica(
    cells: tuple[int, int] = (40, 4),
    bending: str = "midedge",
    *,
    irregular: float | None = 0.25,
    seed: int = 0,
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compare case C4 with the exact elastica under the force that is equivalent to the field."""
    mesh = shear_strip.strip(cells, bending, seed, irregular)
    state = _sheared_by_a_field(mesh, bending, solver)
    end = tip(mesh, state.displacements, x=shear_strip.LENGTH)
    shortening, deflection = shear_strip.ELASTICA[1.0]
    comparisons = [
        Comparison("W", end[2], deflection, allowed=0.002),
        Comparison("U", -end[0], shortening, allowed=0.003),
    ]
    return outcome(mesh_name(cells, irregular), mesh, comparisons, [state])


def _sheared_by_a_field(mesh, bending: str, solver: ms.Newton | None = None) -> ms.Equilibrium:
    """Return the equilibrium of the strip of A1 in the field that is equivalent to its full load."""
    sheet = shear_strip.shell(mesh, bending)
    strip = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    flux_density = shear_strip.FULL_LOAD / (shear_strip.THICKNESS * shear_strip.WIDTH * MAGNETIZATION)
    return ms.equilibrium(
        strip,
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(0, 0, flux_density),
        solver=solver,
    )
