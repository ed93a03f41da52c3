"""Case B7: buckling loads of columns and of a square plate, from the change of the Hessian."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .outcome import Comparison, Outcome, mesh_name, order_of, outcome

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS, POISSON_RATIO = 1.0, 0.1, 0.001, 1e9, 0.3

# P L^2 / (EI), Euler; clamped and pinned: the square of the smallest root of tan x = x.
COLUMNS = {
    "cantilever": np.pi**2 / 4,
    "pinned": np.pi**2,
    "clamped-pinned": 20.19072855642663,
    "clamped": 4 * np.pi**2,
}
PLATE_FACTOR = 4.0  # k in N = k pi^2 D / b^2 for a simply supported square, compressed along one axis


def column(mesh: ms.TriangleMesh, ends: str, bending: str) -> ms.Scene:
    """Return a strip along x, compressed at its far end by its Euler load; a clamped end is moved until it carries
    that."""
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, bending=bending
    )
    near, far = mesh.edges_at(x=0.0), mesh.edges_at(x=LENGTH)
    near_pin, far_pin = ms.Pin(mesh.vertices_at(x=0.0)), ms.Pin(mesh.vertices_at(x=LENGTH), "yz")
    strain = COLUMNS[ends] * THICKNESS**2 / (12.0 * LENGTH**2)  # P / (EA)
    supports = {
        "cantilever": [ms.Clamp(near)],
        "pinned": [near_pin, far_pin],
        "clamped-pinned": [ms.Clamp(near), far_pin],
        "clamped": [ms.Clamp(near), ms.Clamp(far, displacement=(-strain * LENGTH, 0, 0))],
    }[ends]
    force = ms.EdgeLoad(far, (-YOUNG_MODULUS * THICKNESS * strain, 0, 0))
    return ms.Scene(sheet, supports=supports, loads=[] if ends == "clamped" else [force])


def columns(
    cells: tuple[int, int] = (40, 4), bending: str = "midedge", *, irregular: float | None = 0.25
) -> Outcome:
    """Compute the loads of the four Euler columns: each over its closed form, times that form."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells, irregular=irregular, order=order_of(bending))
    found = [ms.linear_buckling(column(mesh, ends, bending)) for ends in COLUMNS]
    loads = [factor * buckling.factors[0] for factor, buckling in zip(COLUMNS.values(), found, strict=True)]
    comparison = Comparison("P L2 / EI", loads, list(COLUMNS.values()), at=tuple(COLUMNS), allowed=0.01)
    return outcome(mesh_name(cells, irregular), mesh, [comparison], found)


def plate(
    cells: tuple[int, int] = (32, 32), bending: str = "midedge", *, irregular: float | None = None
) -> Outcome:
    """Compute the buckling load of a simply supported square under uniaxial compression."""
    mesh = ms.meshes.rectangle(LENGTH, LENGTH, cells, irregular=irregular, order=order_of(bending))
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO, bending=bending
    )
    unit = np.pi**2 * YOUNG_MODULUS * THICKNESS**3 / (12.0 * (1.0 - POISSON_RATIO**2)) / LENGTH**2
    rim = mesh.boundary_vertices
    supports = [
        ms.Pin(rim, "z"),
        ms.Pin(mesh.vertices_at(x=0.0), "x"),
        ms.Pin(mesh.vertices_at(x=0.0, y=0.0), "y"),
    ]
    load = ms.EdgeLoad(mesh.edges_at(x=LENGTH), (-unit, 0, 0))
    found = ms.linear_buckling(ms.Scene(sheet, supports=supports, loads=[load]))
    comparison = Comparison("k", found.factors[0], PLATE_FACTOR, allowed=0.01)
    return outcome(mesh_name(cells, irregular), mesh, [comparison], [found])
