"""Ten-node tetrahedra with curved edges for round solids."""

from __future__ import annotations

import numpy as np

from ..tetrahedra.refine import curved
from ..tetrahedra.tet_mesh import TetMesh


def round_order(mesh: TetMesh, order: int, axes: tuple[int, ...]) -> TetMesh:
    """Return the mesh with tetrahedra of the given order, 1 or 2, whose curved edges follow round surfaces.

    The distance of a midside node from the origin, measured in the coordinates `axes`, is the mean of the distances of the
    edge's ends. So an edge on a cylinder or a sphere around the origin becomes an arc.
    """
    if order == 1:
        return mesh
    across = list(axes)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)

    def project(midpoints: np.ndarray, edges: np.ndarray) -> np.ndarray:
        projected = midpoints.copy()
        wanted, current = radii[edges].mean(axis=1), np.linalg.norm(midpoints[:, across], axis=1)
        factor = np.divide(wanted, current, out=np.ones_like(wanted), where=current > 1e-9 * wanted)
        projected[:, across] *= factor[:, None]
        return projected

    return curved(mesh, project)
