"""Generators of flat rectangles and round disks of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..triangles.triangle_mesh import TriangleMesh
from ._grid import check_size, grid
from ._six_nodes import round_sheet, sheet_of_order


@grouped()
def disk(radius: float, cells: int, *, order: int = 1) -> TriangleMesh | Any:
    """Build a disk around the origin in the plane z = 0, with its normal along +z.

    Ring k has 6 k vertices, so all of the 6 cells^2 faces are nearly equilateral.

    Args:
        radius: m.
        cells: the number of rings.
        order: 1 for three nodes per face; 2 for a QuadraticTriangleMesh, whose boundary edges are arcs.

    >>> disk(0.01, cells=8).n_faces
    384
    """
    radius = positive("radius", "m", radius)
    if isinstance(cells, bool) or not isinstance(cells, (int, np.integer)) or cells < 1:
        raise ValueError(f"cells is the number of rings, an integer of at least 1, got {cells!r}")
    check_size(6 * int(cells) ** 2)
    rings = [np.zeros((1, 3))]
    for k in range(1, cells + 1):
        angle = 2 * np.pi * np.arange(6 * k) / (6 * k)
        rings.append(radius * k / cells * np.stack([np.cos(angle), np.sin(angle), np.zeros(6 * k)], axis=1))
    faces = np.concatenate([_ring_faces(k) for k in range(1, cells + 1)])
    return round_sheet(TriangleMesh(np.concatenate(rings), faces), order, axes=(0, 1))


def _ring_faces(k: int) -> np.ndarray:
    """Return the faces between rings k - 1 and k: in each of six sectors k on the outer ring, and k - 1 on the inner."""
    sector, i = (index.ravel() for index in np.meshgrid(np.arange(6), np.arange(k), indexing="ij"))

    def outer(step):
        return 1 + 3 * k * (k - 1) + (sector * k + i + step) % (6 * k)

    def inner(step):
        before = 1 + 3 * (k - 1) * (k - 2) if k > 1 else 0
        return before + (sector * (k - 1) + i + step) % max(6 * (k - 1), 1)

    on_outer = np.stack([inner(0), outer(0), outer(1)], axis=1)
    on_inner = np.stack([inner(0), outer(1), inner(1)], axis=1)[i < k - 1]
    return np.concatenate([on_outer, on_inner])


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
