"""How wide a body is, however it is turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..mesh.mesh_base import MeshBase


def width_of(mesh: MeshBase) -> float:
    """m, of a mesh at rest: twice the way from the middle of its surface to the vertex that is farthest from it. Of a
    rectangle and a box that is the diagonal."""
    corners = mesh.rest_positions[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    middle = areas @ corners.mean(axis=1) / areas.sum()
    return 2.0 * float(np.linalg.norm(mesh.rest_positions - middle, axis=1).max())
