"""The transfer of a design's magnetization to another mesh of the same body."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

import magshell as ms


def face_centers(solid: ms.Solid) -> np.ndarray:
    """Return the reference centers of the faces of a solid's skin, in the skin's order, (k, 3) m."""
    return solid.mesh.surface.face_barycenters[solid.skin.faces]


def transferred(values: np.ndarray, designed: ms.Solid, other: ms.Solid) -> np.ndarray:
    """Return values for the other solid's skin, (m, ...), each taken from the nearest face of the designed one, (k,
    ...).

    The four triangles on a face of a ten-node tetrahedron have a row each, as in `solid.skin`.
    """
    values = np.asarray(values)
    if len(values) != len(designed.skin.faces):
        raise ValueError(
            f"values must have a row for each of {len(designed.skin.faces)} faces, got {values.shape}"
        )
    _, nearest = cKDTree(face_centers(designed)).query(face_centers(other))
    return values[nearest]
