"""The generator of thick-walled tubes of tetrahedra, closed or a sector."""

from __future__ import annotations

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..tetrahedra.tet_mesh import TetMesh
from ._tet_cells import (
    check_diagonals,
    check_order,
    check_size,
    checked_cells,
    lattice,
    round_order,
    six_each,
    twenty_four_each,
)
from .surfaces_of_revolution import TURN, angle_span, is_full_circle


@grouped()
def tube(
    inner_radius: float,
    outer_radius: float,
    length: float,
    angle: float | tuple[float, float] = TURN,
    *,
    cells: tuple[int, int, int],
    diagonals: str = "alternating",
    order: int = 1,
) -> TetMesh:
    """Build a thick-walled tube around the z axis, 0 <= z <= length.

        x = r cos(phi),   y = r sin(phi)

    Args:
        inner_radius, outer_radius, length: m.
        angle: phi in rad: (from, to), or the width of a range from 0, so that pi / 2 is a quarter between the planes y = 0
            and x = 0. A full circle is closed.
        cells: (through the wall, around, along).
        diagonals: as for `box`. "alternating" on a full circle needs an even number of cells around.
        order: 1 for four nodes; 2 for ten, with the midside nodes on the round surfaces.

    >>> quarter = tube(0.01, 0.02, 0.05, angle=np.pi / 2, cells=(4, 8, 1), order=2)
    >>> len(quarter.vertices_at(x=0.0))
    27
    """
    inner, outer = positive("inner_radius", "m", inner_radius), positive("outer_radius", "m", outer_radius)
    if not inner < outer:
        raise ValueError(f"inner_radius must be smaller than outer_radius, got {inner} and {outer} m")
    length = positive("length", "m", length)
    start, stop = angle_span("angle", angle)
    counts = checked_cells(cells, ("through the wall", "around", "along"))
    check_diagonals(diagonals)
    order = check_order(order)
    check_size(24.0 * np.prod([float(n) for n in counts]))
    closed = is_full_circle(start, stop)
    if closed and counts[1] < 3:
        raise ValueError(f"a closed tube needs at least 3 cells around, got {counts[1]}")
    if closed and diagonals == "alternating" and counts[1] % 2:
        raise ValueError(
            f"a closed tube with alternating diagonals needs an even number of cells around, got {counts[1]}; or "
            'choose diagonals="aligned"'
        )
    if (stop - start) / counts[1] >= 0.5 * TURN:
        raise ValueError("a cell may not span half a turn: give more cells around")
    points, corners, cell = lattice(counts, periodic=closed)
    if diagonals == "crossed":
        binary = np.array([(b & 1, b >> 1 & 1, b >> 2) for b in range(8)])
        seen = (cell[:, None] + binary) / counts
        points, tetrahedra = twenty_four_each(points, corners, seen)
    else:
        tetrahedra = six_each(corners, (cell % 2 == 1) & (diagonals == "alternating"))
    radius = inner + (outer - inner) * points[:, 0]
    phi = start + (stop - start) * points[:, 1]
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), length * points[:, 2]], axis=1)
    return round_order(TetMesh(points, tetrahedra), order, axes=(0, 1))
