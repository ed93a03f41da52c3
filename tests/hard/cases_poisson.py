"""Poisson's ratio from below zero to 1/2: shells in plane stress must not lock."""

from __future__ import annotations

import numpy as np
from answers import both, near, refused
from registry import case
from sheets import shell, strip
from theory import stretch

import magshell as ms

RATIOS = (0.0, 0.3, 0.4999, 0.5, -0.9)


@case("Poisson's ratio {}, pulled to almost twice the length on an irregular mesh", over=RATIOS)
def pulled(ratio):
    mesh = strip((8, 4), length=2.0, width=1.0, irregular=0.25, seed=3)
    sheet = shell(mesh, thickness=0.01, poisson_ratio=ratio)
    stress = 0.4 if ratio > 0 else 1.0  # over E; a larger one would make the width of the sheet negative
    supports = [
        ms.Pin(mesh.vertices_at(x=0.0), "x"),
        ms.Pin(mesh.vertices_at(y=0.0), "y"),
        ms.Pin(np.arange(mesh.n_vertices), "z"),
    ]
    load = ms.EdgeLoad(mesh.edges_at(x=2.0), (stress * 1e6 * 0.01, 0, 0))
    found = ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[load]))
    along = stretch(stress)
    across = np.sqrt(1.0 - ratio * (along**2 - 1.0))
    expected = mesh.rest_positions * (along, across, 1.0)
    return both(
        near("stretch", np.ptp(found.positions[:, 0]) / 2.0, along, rel=1e-9),
        near("positions", found.positions, expected, rel=1e-9),
    )


@case("Poisson's ratio {}: D = E h^3 / (12 (1 - nu^2)) and nothing else", over=RATIOS)
def simply_supported_plate(ratio):
    """Compare the deflection with w = 0.00406235 q a^4 / D, which holds for every Poisson's ratio."""
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(16, 16), diagonals="crossed")
    thickness, pressure = 1e-3, 1e-6
    sheet = shell(mesh, thickness=thickness, poisson_ratio=ratio)
    corners = [mesh.nearest_vertex(x) for x in ((0, 0, 0), (1, 0, 0))]
    supports = [ms.Pin(mesh.boundary_vertices, "z"), ms.Pin(corners[:1], "xy"), ms.Pin(corners[1:], "y")]
    scene = ms.Scene(sheet, supports=supports, loads=[ms.AreaLoad((0, 0, pressure))])
    middle = mesh.nearest_vertex((0.5, 0.5, 0))
    rigidity = 1e6 * thickness**3 / (12.0 * (1.0 - ratio**2))
    got = ms.linear_response(scene).displacements[middle, 2]
    return near("w", got, 0.00406235 * pressure / rigidity, rel=2e-2)


@case("Poisson's ratio {}: no such material", over=(0.5 + 1e-12, -1.0))
def impossible(ratio):
    return refused(lambda: shell(strip(), poisson_ratio=ratio), r"poisson_ratio \[1\] must be in \(-1, 1/2\]")
