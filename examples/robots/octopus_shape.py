"""The shape of an octopus of eight legs around a head, and its mesh: eight times the same eighth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from magshell.mesh import generate as meshes
from magshell.mesh.tetrahedra.repair import coincident
from magshell.mesh.tetrahedra.tet_mesh import TetMesh
from magshell.mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from magshell._input.kinds import Numbers

LEGS = 8
HEAD, LEG = 0.1, 0.5  # m: from the middle to where legs begin; along a leg
THICKNESS, TAPER, DOME = (
    0.06,
    0.55,
    0.16,
)  # m; what of it and of the width is lost at a tip; m, the head above
BEND, EARLY = np.radians(70.0), 0.8  # of a leg at rest, downwards at its tip: BEND share^EARLY
ACROSS, LAYERS = 2, 2  # cells

_SHARES = np.linspace(0.0, 1.0, 201)


def _profile() -> np.ndarray:
    """Return the middle line of a leg, outwards and up, (201, 2) m."""
    down = BEND * _SHARES**EARLY
    steps = np.stack([np.cos(down), -np.sin(down)], axis=1)[:-1] * LEG / (len(_SHARES) - 1)
    return np.add((HEAD, 0.0), np.cumsum(np.concatenate([np.zeros((1, 2)), steps]), axis=0))


def curved_leg(points: np.ndarray) -> np.ndarray:
    """Map points of the flat leg, with its eighth of the head, to its curved shape: m outwards, across and up.

    points: (n, 3) of the flat one: m outwards, m across, and height from 0 to 1.
    """
    outwards, across, height = points.T
    share = np.clip((outwards - HEAD) / LEG, 0.0, 1.0)
    x, y = (np.interp(share, _SHARES, each) for each in _profile().T)
    down, over = BEND * share**EARLY, THICKNESS * (1.0 - TAPER * share) * (height - 0.5)
    within = np.minimum(outwards / HEAD, 1.0)
    x = np.where(within < 1.0, outwards, x) + np.sin(down) * over
    y = y + np.cos(down) * over + DOME * (1.0 - within**2) * height
    return np.stack([x, across * (1.0 - TAPER * share), y], axis=1)


def around(points: np.ndarray, leg: Numbers) -> np.ndarray:
    """Rotate points, as `curved_leg` returns them, to their leg in the world: y up, the legs around it.

    leg: one number for all points, or one for each.
    """
    angle = 2.0 * np.pi * leg / LEGS
    outwards, across, up = points.T
    x = np.cos(angle) * outwards - np.sin(angle) * across
    z = -np.sin(angle) * outwards - np.cos(angle) * across
    return np.stack([x, up, z], axis=1)


def octopus_mesh(cells: int) -> tuple[TetMesh, np.ndarray, np.ndarray]:
    """Build the mesh; cells: along a leg.

    Also returns the leg of each tetrahedron, (n_t,), -1 in the head, and whether it is in the upper half.
    """
    points, faces = _eighth(cells)
    star = np.concatenate([around(points, leg) for leg in range(LEGS)])
    first = coincident(star, 1e-6)
    used, numbers = np.unique(first, return_inverse=True)
    turned = np.concatenate([faces + leg * len(points) for leg in range(LEGS)])
    sheet = TriangleMesh(star[used][:, (0, 2, 1)] * (1, -1, 1), numbers[turned])
    flat = meshes.extruded(sheet, 1.0, LAYERS)
    leg, vertex = np.divmod(np.tile(used, LAYERS + 1), len(points))
    local = np.column_stack([points[vertex, :2], flat.rest_positions[:, 2]])
    mesh = TetMesh(around(curved_leg(local), leg), flat.tetrahedra)
    in_arm = (local[:, 0] > HEAD - 1e-9)[mesh.tetrahedra].all(axis=1)
    directions = np.arctan2(-mesh.tetrahedron_barycenters[:, 2], mesh.tetrahedron_barycenters[:, 0])
    nearest = np.round(directions * LEGS / (2.0 * np.pi)).astype(int) % LEGS
    return mesh, np.where(in_arm, nearest, -1), flat.tetrahedron_barycenters[:, 2] > 0.5


def _eighth(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Return one flat leg and its triangle of the head.

    Points are (n, 3) m in the coordinates of `curved_leg`, some of them twice; faces (n_f, 3).
    """
    width = 2.0 * HEAD * np.tan(np.pi / LEGS)
    arm = meshes.rectangle(LEG, width, cells=(cells, ACROSS)).transformed(translation=(HEAD, -width / 2, 0))
    corners = np.array([(0, 0, 0), (HEAD, -width / 2, 0), (HEAD, width / 2, 0)])
    middles = 0.5 * (corners[[0, 0, 1]] + corners[[1, 2, 2]])
    halved = np.array([(0, 3, 4), (3, 1, 5), (3, 5, 4), (4, 5, 2)])
    return (
        np.concatenate([arm.rest_positions, corners, middles]),
        np.concatenate([arm.faces, halved + arm.n_vertices]),
    )
