"""Cases A4 and B3: a hemisphere with or without a hole at its pole, pulled and pushed at four points of its rim."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .outcome import Comparison, Outcome, mesh_name, order_of, outcome

RADIUS, THICKNESS, YOUNG_MODULUS, POISSON_RATIO = 10.0, 0.04, 6.825e7, 0.3
HOLE = np.radians(18.0)


def quarter(
    cells: tuple[int, int], bending: str, hole: float = HOLE, irregular: float | None = None
) -> ms.TriangleMesh | ms.QuadraticTriangleMesh:
    """Return a quarter of the hemisphere; cells: those of the whole, around and along the meridian."""
    if cells[0] % 4:
        raise ValueError(f"a quarter needs a multiple of 4 cells around, got {cells[0]}")
    of_quarter = (cells[0] // 4, cells[1])
    span = (hole, np.pi / 2, np.pi / 2)
    return ms.meshes.spherical_cap(
        RADIUS, *span, cells=of_quarter, irregular=irregular, order=order_of(bending)
    )


def scene(mesh: ms.TriangleMesh, bending: str, force: float) -> ms.Scene:
    """Return a scene pulled outwards by `force` [N] along x and pushed inwards along y; half of each acts on a
    quarter."""
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO, bending=bending
    )
    pulled, pushed = mesh.nearest_vertex((RADIUS, 0, 0)), mesh.nearest_vertex((0, RADIUS, 0))
    supports = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0)), ms.Pin(pulled, "z")]
    loads = [ms.PointLoad(pulled, (force / 2, 0, 0)), ms.PointLoad(pushed, (0, -force / 2, 0))]
    return ms.Scene(sheet, supports=supports, loads=loads)


def radial_displacements(mesh: ms.TriangleMesh, displacements: np.ndarray) -> tuple[float, float]:
    """Return the displacements outwards at the pulled point and inwards at the pushed one, m."""
    pulled, pushed = mesh.nearest_vertex((RADIUS, 0, 0)), mesh.nearest_vertex((0, RADIUS, 0))
    return displacements[pulled, 0], -displacements[pushed, 1]


def large_deflection(
    cells: tuple[int, int] = (64, 16),
    bending: str = "midedge",
    *,
    irregular: float | None = None,
    solver: ms.Newton | None = None,
) -> Outcome:
    """Compute case A4 at the full load of 400, in one solve from rest.

    References: 4.0742 outwards, 8.1495 inwards, the limit of Kirchhoff-Love theory, known to 0.4 % because point forces
    converge slowly; `midedge2` has 4.0730 and 8.1455 on 128 x 32 cells, and three of its meshes extrapolate to 4.0753 and
    8.1495. Abaqus S4R, whose shells have shear: 4.067, 8.178 (Sze, Liu, Lo, Finite Elem. Anal. Des. 40 (2004) 1551).
    """
    mesh = quarter(cells, bending, irregular=irregular)
    state = ms.equilibrium(scene(mesh, bending, force=400.0), solver=solver)
    pulled, pushed = radial_displacements(mesh, state.displacements)
    comparisons = [
        Comparison("U, pulled", pulled, 4.0742, allowed=0.015),
        Comparison("V, pushed", pushed, 8.1495, allowed=0.015),
    ]
    return outcome(mesh_name(cells, irregular), mesh, comparisons, [state])


def small_deflection(
    cells: tuple[int, int] = (128, 32), bending: str = "midedge", *, irregular: float | None = None
) -> Outcome:
    """Compute case B3: the radial displacement under forces of 2 to first order, with the hole and without.

    References: FinEtools (0.0924 without the hole, 0.093 with a slightly larger one), MacNeal and Harder (0.094).
    """
    meshes = quarter(cells, bending, HOLE, irregular), quarter(cells, bending, 0.0, irregular)
    responses = [ms.linear_response(scene(mesh, bending, force=2.0)) for mesh in meshes]
    hole, closed = (
        np.mean(radial_displacements(mesh, response.displacements))
        for mesh, response in zip(meshes, responses, strict=True)
    )
    comparisons = [
        Comparison("u, hole", [hole, hole], [0.093, 0.094], at=("FinEtools", "MacNeal-Harder"), allowed=0.01),
        Comparison("u, closed", closed, 0.0924, allowed=0.01),
    ]
    return outcome(mesh_name(cells, irregular), meshes[0], comparisons, responses)
