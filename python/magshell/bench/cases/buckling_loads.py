"""B7: buckling loads of columns and of a square plate, from the change of the Hessian."""

from __future__ import annotations

import numpy as np

import magshell as ms

from .outcome import Comparison, Outcome, outcome

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 1.0, 0.1, 0.001, 1e9
COLUMN_STIFFNESS = YOUNG_MODULUS * WIDTH * THICKNESS**3 / 12.0  # EI

# P L^2 / (EI), Euler; clamped and pinned: the square of the first root of tan x = x.
COLUMNS = {"cantilever": np.pi**2 / 4, "pinned": np.pi**2, "clamped-pinned": 20.19072855642663, "clamped": 4 * np.pi**2}


def column(mesh: ms.TriangleMesh, ends: str, bending: str) -> ms.Scene:
    """A strip along x, pushed at x = LENGTH by its Euler load."""
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0, bending=bending
    )
    first, last = mesh.edges_at(x=0.0), mesh.edges_at(x=LENGTH)
    near, far = mesh.vertices_at(x=0.0), mesh.vertices_at(x=LENGTH)
    supports = {
        "cantilever": [ms.Clamp(first)],
        "pinned": [ms.Pin(near), ms.Pin(far, "yz")],
        "clamped-pinned": [ms.Clamp(first), ms.Pin(far, "yz")],
        "clamped": [ms.Clamp(first), ms.SymmetryPlane((1, 0, 0), (LENGTH, 0, 0))],
    }
    load = COLUMNS[ends] * COLUMN_STIFFNESS / LENGTH**2
    return ms.Scene(sheet, supports=supports[ends], loads=[ms.EdgeLoad(last, (-load / WIDTH, 0, 0))])
