"""A design's magnetization on another mesh of the same body."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

import magshell as ms


def face_centers(solid: ms.Solid) -> np.ndarray:
    """(k, 3) m, at rest: of the faces of its skin, in the skin's order."""
    return solid.mesh.surface.face_barycenters[solid.skin.faces]


def transferred(values: np.ndarray, designed: ms.Solid, other: ms.Solid) -> np.ndarray:
    """(m, ...) for the other solid's skin, from (k, ...) for the designed one's: of the nearest face's center.

    Four triangles of a ten-node tetrahedron's face each have a row, as `solid.skin` has.
    """
    values = np.asarray(values)
    if len(values) != len(designed.skin.faces):
        raise ValueError(
            f"values must have a row for each of {len(designed.skin.faces)} faces, got {values.shape}"
        )
    _, nearest = cKDTree(face_centers(designed)).query(face_centers(other))
    return values[nearest]
