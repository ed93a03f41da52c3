"""The generator of flat rectangles of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..triangles.triangle_mesh import TriangleMesh
from ._grid import grid
from ._six_nodes import sheet_of_order


@grouped()
def rectangle(
    length: float,
    width: float,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    *,
    order: int = 1,
) -> TriangleMesh | Any:
    """Build the rectangle [0, length] x [0, width] in the plane z = 0, with its normal along +z.

    Args:
        length, width: along x and y, m.
        cells: numbers of cells along x and y.
        diagonals: "alternating", "aligned" (all pointing away from the origin) or "crossed" (four faces per cell).
        irregular: largest random displacement of interior vertices, as a fraction of their spacing, at most 0.25.
        seed: the seed of these displacements; the same seed gives the same mesh.
        order: 1 for three nodes per face; 2 for a QuadraticTriangleMesh, whose `elements` are the same triangles.

    >>> rectangle(0.12, 0.02, cells=(60, 10)).n_faces
    1200
    """
    length, width = positive("length", "m", length), positive("width", "m", width)
    g = grid(cells, diagonals, irregular, seed)
    x, y = g.parameters.T
    mesh = TriangleMesh(np.stack([length * x, width * y, np.zeros_like(x)], axis=1), g.faces)
    return sheet_of_order(mesh, order)
