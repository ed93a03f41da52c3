"""Ten nodes on round solids."""

from __future__ import annotations

import numpy as np

from ..tetrahedra.refine import curved
from ..tetrahedra.tet_mesh import TetMesh


def round_order(mesh: TetMesh, order: int, axes: tuple[int, ...]) -> TetMesh:
    """The mesh with tetrahedra of this order; nodes on edges lie at the mean of their ends' distances from the origin of
    the given axes, so that an edge on a round surface is an arc of it."""
    if order == 1:
        return mesh
    across = list(axes)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)

    def place(midpoints: np.ndarray, edges: np.ndarray) -> np.ndarray:
        placed = midpoints.copy()
        wanted, there = radii[edges].mean(axis=1), np.linalg.norm(midpoints[:, across], axis=1)
        factor = np.divide(wanted, there, out=np.ones_like(wanted), where=there > 1e-9 * wanted)
        placed[:, across] *= factor[:, None]
        return placed

    return curved(mesh, place)
