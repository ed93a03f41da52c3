"""A part of a sphere: a cap, a zone, a quarter of either, or all of it."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._checks.quantity import quantity
from .._checks.scalars import positive
from .._machine.entry import grouped
from ..mesh.triangle_mesh import TriangleMesh
from ._angles import TURN, angle_span, is_full_turn
from ._grid import checked_cells, grid
from ._six_nodes import round_sheet
from ._surface import surface


@grouped()
def spherical_cap(
    radius: float,
    angle_from: float = 0.0,
    angle_to: float = np.pi / 2,
    sector_angle: float | tuple[float, float] = TURN,
    *,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    order: int = 1,
) -> TriangleMesh | Any:
    """The part of the sphere around the origin between two polar angles, its normal outwards.

    Args:
        radius: m.
        angle_from, angle_to: rad from the +z axis, 0 <= angle_from < angle_to <= pi. At 0 and pi the cap
            closes in a vertex at the pole, with a fan of faces around it.
        sector_angle: azimuth in rad from the x axis, from 0 to it or (from, to). A full turn joins its seam.
        cells: (around, along the meridian).
        diagonals, irregular, seed: as for `rectangle`.
        order: likewise; nodes between corners lie on the sphere too.

    >>> import math
    >>> quarter = spherical_cap(10.0, math.radians(18), math.pi / 2, math.pi / 2, cells=(16, 16))
    >>> len(quarter.vertices_at(y=0.0)), len(quarter.vertices_at(z=0.0))
    (17, 17)
    """
    radius = positive("radius", "m", radius)
    angle_from = float(quantity("angle_from", "rad", angle_from, ()))
    angle_to = float(quantity("angle_to", "rad", angle_to, ()))
    if not 0 <= angle_from < angle_to <= np.pi:
        raise ValueError(
            f"polar angles [rad] must be 0 <= angle_from < angle_to <= pi, got {angle_from} and {angle_to}"
        )
    start, stop = angle_span("sector_angle", sector_angle)
    poles = (angle_from == 0, angle_to == np.pi)
    around, along = checked_cells(cells)
    if all(poles) and along < 2:
        raise ValueError(f"from pole to pole a cap needs at least 2 cells along the meridian, got {along}")
    g = grid((along, around), diagonals, irregular, seed, periodic=is_full_turn(start, stop), poles=poles)
    theta = angle_from + (angle_to - angle_from) * g.parameters[:, 0]
    phi = start + (stop - start) * g.parameters[:, 1]
    sine = np.sin(theta)
    points = radius * np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: barycenters)
    return round_sheet(mesh, order, axes=(0, 1, 2))
