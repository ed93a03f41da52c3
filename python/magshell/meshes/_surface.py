"""From a bent grid to a mesh."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..mesh.triangle_mesh import TriangleMesh


def surface(points: np.ndarray, faces: np.ndarray, outwards: Callable[..., Any]) -> TriangleMesh:
    """The mesh, if the normal of each face is on the side of outwards(barycenters).

    Bending a grid is not linear: a face that is merely slanted in the unit square may turn over on a
    coarse or pointed surface.
    """
    mesh = TriangleMesh(points, faces)
    turned = np.flatnonzero((mesh.face_normals * outwards(mesh.face_barycenters)).sum(axis=1) <= 0)
    if len(turned):
        raise ValueError(
            f"irregular moves turn face {turned[0]} over; choose a smaller fraction, another seed, more cells"
        )
    return mesh
