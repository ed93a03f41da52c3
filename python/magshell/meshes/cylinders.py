"""A cylinder, whole or in part."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._checks.scalars import positive
from .._machine.entry import grouped
from ..mesh.triangle_mesh import TriangleMesh
from ._angles import TURN, angle_span, is_full_turn
from ._grid import checked_cells, grid
from ._six_nodes import round_sheet
from ._surface import surface


@grouped()
def cylinder(
    radius: float,
    length: float,
    angle: float | tuple[float, float] = TURN,
    *,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    order: int = 1,
) -> TriangleMesh | Any:
    """A cylinder around the y axis, 0 <= y <= length, its normal outwards.

        x = radius sin(phi),   z = radius cos(phi)

    Args:
        radius, length: m.
        angle: phi in rad, measured from the top (+z) towards +x: (from, to), or the width of a span symmetric
            about the top, so that a roof of half angle a has angle = 2 a. A full turn is closed: its seam is
            joined.
        cells: (around, along).
        diagonals, irregular, seed: as for `rectangle`.
        order: likewise; nodes between corners lie on the cylinder too.

    >>> import math
    >>> roof = cylinder(25.0, 50.0, angle=math.radians(80.0), cells=(16, 16))
    >>> len(roof.vertices_at(x=0.0, z=25.0))
    17
    """
    radius, length = positive("radius", "m", radius), positive("length", "m", length)
    start, stop = angle_span("angle", angle, symmetric=True)
    # the grid closes along its second parameter, so that is phi; -y then keeps d/du x d/dv outwards
    around, along = checked_cells(cells)
    g = grid((along, around), diagonals, irregular, seed, periodic=is_full_turn(start, stop))
    y = length * (1 - g.parameters[:, 0])
    phi = start + (stop - start) * g.parameters[:, 1]
    points = np.stack([radius * np.sin(phi), y, radius * np.cos(phi)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: barycenters * [1, 0, 1])
    return round_sheet(mesh, order, axes=(0, 2))
