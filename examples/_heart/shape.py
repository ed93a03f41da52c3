"""A heart with one chamber, which opens through a vessel at its top: five ellipsoids and capsules blended, minus a
hollow.

Neither shape nor size of [Chen22]'s heart is stated. Its mesh of 665 vertices and 1326 = 2 x 665 - 4 faces has all of
its vertices on the surface, with the topology of a ball; a chamber that opens to the outside has the same topology.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from scipy.spatial.transform import Rotation

import magshell as ms

UNIT = 0.2e-3  # m: the heart is 95 units high, 19 mm
WALL = 13.0  # units, of the main chamber
TOP = 50.0  # units: where the vessel is cut off
TILT = Rotation.from_euler("y", -20, degrees=True)
TETRAHEDRA = 1963  # [Chen22] Table 1


def chamber() -> ms.shapes.Shape:
    """Return the hollow: the chamber and the bore of the vessel above it, m."""
    room = ms.shapes.ellipsoid((31 - WALL, 28 - WALL, 44 - WALL)).rotated(TILT)
    bore = ms.shapes.capsule((-4, 0, 10), (-4, 0, 90), 7)
    return room.smooth_union(bore, radius=8).scaled(UNIT)


def outside() -> ms.shapes.Shape:
    """Return the outer shape of the heart, as if it were solid, m."""
    left = ms.shapes.ellipsoid((31, 28, 44)).rotated(TILT)
    right = ms.shapes.ellipsoid((22, 22, 32), center=(-12, -4, 8)).rotated(TILT)
    atria = [ms.shapes.ball(17, center=(17, 4, 33)), ms.shapes.ball(16, center=(-27, 2, 28))]
    vessel = ms.shapes.capsule((-4, 0, 20), (-4, 0, 70), 18)
    return left.smooth_union(right, *atria, vessel, radius=12).scaled(UNIT)


@dataclass(frozen=True)
class Heart:
    """A mesh of the heart, four nodes a tetrahedron; faces and areas are those of this mesh."""

    mesh: ms.TetMesh

    @classmethod
    def of(cls, n_tetrahedra: int = TETRAHEDRA) -> Heart:
        shape = (outside() - chamber()) & ms.shapes.half_space((0, 0, 1), (0, 0, TOP * UNIT))
        return cls(ms.meshes.from_distance(shape, n_tetrahedra=n_tetrahedra))

    @cached_property
    def sides(self) -> np.ndarray:
        """The part of the surface that each face is on, (n_f,).

        0: outside; 1: in the chamber and the bore; 2: where the vessel is cut off.
        """
        return sides_of(self.mesh)

    @property
    def lower_half(self) -> np.ndarray:
        """The outer faces below the middle."""
        return np.flatnonzero((self.sides == 0) & (self.mesh.face_barycenters[:, 2] < 0))

    @property
    def ribbon(self) -> np.ndarray:
        """The outer faces in an oblique band around the widest part."""
        height = self.mesh.face_barycenters @ (0.25, 0.15, 1.0) / UNIT
        return np.flatnonzero((self.sides == 0) & (np.abs(height - 2) < 9))

    @property
    def handles(self) -> int:
        """The genus of the surface: 0 unless coarse tetrahedra leave a hole in a wall."""
        surface = self.mesh.surface
        return 1 - (surface.n_vertices - surface.n_edges + surface.n_faces) // 2


def sides_of(mesh: ms.TetMesh) -> np.ndarray:
    """Return the part of the surface that each face of a mesh of the heart is on, (n_f,), as `Heart.sides`."""
    centers = mesh.face_barycenters
    away = [outside()(centers), chamber()(centers), centers[:, 2] - TOP * UNIT]
    return np.argmin(np.abs(away), axis=0)


class Chamber:
    """The volume inside a mesh of the heart, closed at the vessel's mouth by a fan of triangles around its center."""

    def __init__(self, mesh: ms.TetMesh):
        faces = mesh.faces[sides_of(mesh) == 1].astype(np.int64)
        sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, count = np.unique(sides, axis=0, return_counts=True)
        self._faces, self._mouth = torch.from_numpy(faces), torch.from_numpy(np.unique(edges[count == 1]))

    def volume(self, positions) -> torch.Tensor:
        """Compute the volume [m3] for positions (..., n_v, 3) m.

        Measured from the mouth's center, the fan of triangles contributes nothing.
        """
        positions = as_tensor(positions)
        seen = positions - positions[..., self._mouth, :].mean(dim=-2, keepdim=True)
        a, b, c = seen[..., self._faces, :].unbind(-2)
        # a . (b x c): torch's derivative of a determinant divides by what vanishes where a face looks at the center.
        return -(a * torch.linalg.cross(b, c)).sum(dim=(-1, -2)) / 6


def as_tensor(positions) -> torch.Tensor:
    """Return a tensor unchanged; copy an array, which may be read-only."""
    return positions if isinstance(positions, torch.Tensor) else torch.tensor(np.array(positions))
