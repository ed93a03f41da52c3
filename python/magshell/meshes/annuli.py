"""A flat ring, and a part of one."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._checks.quantity import quantity
from .._checks.scalars import positive
from .._machine.entry import grouped
from ..mesh.triangle_mesh import TriangleMesh
from ._angles import angle_span, is_full_turn
from ._grid import grid
from ._six_nodes import round_sheet
from ._surface import surface


@grouped()
def annulus(
    inner_radius: float,
    outer_radius: float,
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    *,
    order: int = 1,
) -> TriangleMesh | Any:
    """The ring between two radii [m] around the origin in the plane z = 0, its normal along +z.

    Args:
        inner_radius, outer_radius: m.
        cells: (radial, around).
        diagonals, irregular, seed: as for `rectangle`.
        order: likewise; edges on its rims are arcs.

    >>> import magshell as ms
    >>> ms.meshes.annulus(0.01, 0.02, cells=(2, 24)).n_faces
    96
    """
    return sector(inner_radius, outer_radius, 2 * np.pi, cells, diagonals, irregular, seed, order=order)


@grouped()
def sector(
    inner_radius: float,
    outer_radius: float,
    angle: float | tuple[float, float],
    cells: tuple[int, int],
    diagonals: str = "alternating",
    irregular: float | None = None,
    seed: int = 0,
    *,
    order: int = 1,
) -> TriangleMesh | Any:
    """The part of a ring between two angles from the x axis, in the plane z = 0, its normal along +z.

    Args:
        inner_radius, outer_radius: m. With an inner radius of 0 the sector comes to a point at the origin.
        angle: rad, from 0 to `angle` or (from, to). A full turn closes the ring: then the seam is joined.
        cells: (radial, around).
        diagonals, irregular, seed: as for `rectangle`.
        order: likewise; edges on its rims are arcs.

    >>> import math
    >>> sector(0.0, 0.01, math.pi / 2, cells=(4, 6)).boundary_loops[0].size
    14
    """
    outer = positive("outer_radius", "m", outer_radius)
    inner = float(quantity("inner_radius", "m", inner_radius, ()))
    if not 0 <= inner < outer:
        raise ValueError(f"inner_radius [m] must be in [0, outer_radius = {outer}), got {inner_radius}")
    start, stop = angle_span("angle", angle)
    g = grid(cells, diagonals, irregular, seed, periodic=is_full_turn(start, stop), poles=(inner == 0, False))
    radius = inner + (outer - inner) * g.parameters[:, 0]
    theta = start + (stop - start) * g.parameters[:, 1]
    points = np.stack([radius * np.cos(theta), radius * np.sin(theta), np.zeros_like(theta)], axis=1)
    mesh = surface(points, g.faces, lambda barycenters: np.array([0.0, 0.0, 1.0]))
    return round_sheet(mesh, order, axes=(0, 1))
