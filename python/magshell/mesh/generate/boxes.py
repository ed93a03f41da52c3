"""The generator of rectangular blocks of tetrahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import quantity
from ..._runtime.solver_entry_point import grouped
from ..tetrahedra.tet_mesh import TetMesh
from ._tet_cells import (
    check_diagonals,
    check_order,
    check_size,
    checked_cells,
    lattice,
    six_each,
    twenty_four_each,
)

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


@grouped()
def box(
    size: Numbers, cells: tuple[int, int, int], diagonals: str = "alternating", order: int = 1
) -> TetMesh:
    """Build the block [0, a] x [0, b] x [0, c] of tetrahedra.

    Args:
        size: (a, b, c), m.
        cells: numbers of cells along x, y and z.
        diagonals: how cells are divided. "alternating": six tetrahedra per cell, mirrored from cell to cell; with even
            numbers of cells the block is its own mirror image, and six tetrahedra meet at each of its corners. "aligned":
            six tetrahedra per cell, all cells alike. "crossed": 24 per cell, with a vertex in the middle of each cell and
            side; the block is its own mirror image for any numbers of cells.
        order: 1 for four nodes, 2 for ten.

    >>> box((0.1, 0.01, 0.01), cells=(20, 2, 2)).n_tetrahedra
    480
    """
    size = quantity("size", "m", size, (3,))
    if not (size > 0).all():
        raise ValueError(f"size [m] must be positive, got {size.tolist()}")
    counts = checked_cells(cells, ("along x", "y", "z"))
    check_diagonals(diagonals)
    order = check_order(order)
    check_size(24.0 * np.prod([float(n) for n in counts]))
    points, corners, cell = lattice(counts)
    points = points * size
    if diagonals == "crossed":
        points, tetrahedra = twenty_four_each(points, corners, points[corners])
    else:
        tetrahedra = six_each(corners, (cell % 2 == 1) & (diagonals == "alternating"))
    mesh = TetMesh(points, tetrahedra)
    return mesh.second_order() if order == 2 else mesh
