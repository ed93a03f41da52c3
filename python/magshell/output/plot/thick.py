"""Shells drawn with their thickness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.triangles.thickened import thickened
from ...mesh.triangles.triangle_mesh import TriangleMesh
from ..results.state import State
from .solids import Solid, sheet


def thick_skins(state: State, shades: np.ndarray) -> tuple[list[Solid], np.ndarray]:
    """Return the sides of shells, their walls, and the surfaces of solids; and the border lines (k, 2, 3) m of the walls.

    state: on surfaces. shades: (3,), or colours of its faces or vertices, (n_f, 3) or (n_v, 3); colours of vertices become
    those of faces. Raises ValueError, with the face, for a shell that bends more sharply than its thickness allows.
    """
    mesh, thickness = state.mesh, state.thickness()
    if shades.ndim == 1:
        shades = np.broadcast_to(shades, (mesh.n_faces, 3))
    elif len(shades) != mesh.n_faces:
        shades = shades[mesh.faces].mean(axis=1)
    thick = thickness > 0.0
    solids = [sheet(state.positions, mesh.faces[~thick], shades[~thick])] if not thick.all() else []
    if not thick.any():
        return solids, np.zeros((0, 2, 3))
    used, faces = np.unique(mesh.faces[thick], return_inverse=True)
    shell = TriangleMesh(mesh.rest_positions[used], faces.reshape(-1, 3))
    points, all_faces = thickened(shell, state.positions[used], thickness[thick])
    sides, walls = all_faces[: 2 * shell.n_faces], all_faces[2 * shell.n_faces :]
    own = shades[thick]
    behind = np.nonzero((shell.edge_faces < 0).any(axis=1)[shell.face_edges])[
        0
    ]  # the face of each pair of walls
    solids.append(sheet(points, sides, np.concatenate([own, own])))
    if len(walls):
        solids.append(replace(sheet(points, walls, np.concatenate([own[behind], own[behind]])), smooth=False))
    half = len(walls) // 2
    ends = np.concatenate([walls[:half][:, [0, 1]], walls[half:][:, [1, 2]]])
    return solids, points[ends]
