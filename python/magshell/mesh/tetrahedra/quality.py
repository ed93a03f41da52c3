"""Quality measures of the tetrahedra of a mesh."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.frozen import Frozen
from ..mesh_base import frozen
from ..topology import EDGES, FACES
from .jacobian import jacobians, least_jacobians

if TYPE_CHECKING:
    from .tet_mesh import TetMesh


class TetQuality(Frozen):
    """The quality measures of a mesh's tetrahedra in the reference configuration, as arrays; `print` shows extremes.

    All refer to the four corners, but `volume_ratios` and `jacobian_ratios`, which take the curved edges of ten-node
    tetrahedra into account. Small dihedral angles make the stiffness matrix ill-conditioned, and angles near 180 degrees
    make strains inaccurate: angles between 20 and 140 degrees are best. A regular tetrahedron has 70.5 degrees.

    >>> import magshell as ms
    >>> ms.meshes.box((1.0, 1.0, 1.0), cells=(2, 2, 2)).quality
    TetQuality of 48 tetrahedra
      dihedral angles 45.0 to 90.0 deg, radius ratio at least 0.717, aspect at most 2, volumes 1 to 1
      smallest angles: 45.0 deg (tetrahedron 0), 45.0 deg (tetrahedron 1), 45.0 deg (tetrahedron 2)
    """

    def __init__(self, mesh: TetMesh):
        self._mesh = mesh

    @cached_property
    def _corners(self) -> np.ndarray:
        return self._mesh.rest_positions[self._mesh.corners]

    @cached_property
    def _lengths(self) -> np.ndarray:
        """The lengths of the edges of each tetrahedron, straight from corner to corner, (n_t, 6) m."""
        ends = self._corners[:, EDGES]
        return np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)

    @cached_property
    def _face_vectors(self) -> np.ndarray:
        """The outward normal vectors of the faces, with twice the area as length, (n_t, 4, 3) m2."""
        a, b, c = np.moveaxis(self._corners[:, FACES], 2, 0)
        return np.cross(b - a, c - a)

    @cached_property
    def _volumes(self) -> np.ndarray:
        a, b, c = np.moveaxis(self._corners[:, 1:] - self._corners[:, :1], 1, 0)
        return np.einsum("ti,ti->t", np.cross(a, b), c) / 6

    @cached_property
    def dihedral_angles(self) -> np.ndarray:
        """The inner dihedral angles at the edges 01 12 20 03 13 23, (n_t, 6) rad."""
        normals = self._face_vectors
        opposite = np.array([[k for k in range(4) if k not in edge] for edge in EDGES.tolist()])
        one, other = normals[:, opposite[:, 0]], normals[:, opposite[:, 1]]
        sine = np.linalg.norm(np.cross(one, other), axis=2)
        return frozen(np.arctan2(sine, -np.einsum("tei,tei->te", one, other)))

    @cached_property
    def smallest_angles(self) -> np.ndarray:
        """The smallest dihedral angle of each tetrahedron, (n_t,) rad."""
        return frozen(self.dihedral_angles.min(axis=1))

    @cached_property
    def largest_angles(self) -> np.ndarray:
        """The largest dihedral angle of each tetrahedron, (n_t,) rad."""
        return frozen(self.dihedral_angles.max(axis=1))

    @cached_property
    def radius_ratios(self) -> np.ndarray:
        """The radius ratio of each tetrahedron, (n_t,): three times the inscribed over the circumscribed radius.

        It is 1 for a regular tetrahedron, and 0 for a flat one.
        """
        inscribed = 6 * self._volumes / np.linalg.norm(self._face_vectors, axis=2).sum(axis=1)
        # Crelle's formula: 6 V R is the area of a triangle whose sides are the products of opposite edges
        sides = np.sort(self._lengths[:, [0, 1, 2]] * self._lengths[:, [5, 3, 4]], axis=1).T
        c, b, a = sides
        area = 0.25 * np.sqrt(np.maximum((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0))
        return frozen(18 * inscribed * self._volumes / area)

    @cached_property
    def aspects(self) -> np.ndarray:
        """The aspect ratio of each tetrahedron, (n_t,): longest edge over shortest height, divided by sqrt(3/2).

        It is 1 for a regular tetrahedron.
        """
        height = 6 * self._volumes / np.linalg.norm(self._face_vectors, axis=2).max(axis=1)
        return frozen(self._lengths.max(axis=1) / (np.sqrt(1.5) * height))

    @cached_property
    def volume_ratios(self) -> np.ndarray:
        """The volume of each tetrahedron over the mean volume of all, (n_t,)."""
        return frozen(self._mesh.volumes / self._mesh.volumes.mean())

    @cached_property
    def jacobian_ratios(self) -> np.ndarray:
        """The smallest Jacobian determinant of each tetrahedron over its mean, (n_t,).

        It is 1 if all edges are straight with their nodes in the middle.
        """
        if self._mesh.order == 1:
            return frozen(np.ones(self._mesh.n_tetrahedra))
        coefficients = jacobians(self._mesh.rest_positions[self._mesh.tetrahedra])
        return frozen(least_jacobians(coefficients) / coefficients.mean(axis=1))

    def worst(self, count: int = 3) -> np.ndarray:
        """Return the `count` tetrahedra with the smallest dihedral angles, worst first.

        Of equal ones, the lowest number comes first.
        """
        return np.argsort(np.round(self.smallest_angles, 9), kind="stable")[:count]

    def __repr__(self) -> str:
        worst = ", ".join(
            f"{np.degrees(self.smallest_angles[t]):.1f} deg (tetrahedron {t})" for t in self.worst()
        )
        bent = (
            ""
            if self._mesh.order == 1
            else f", Jacobian at least {self.jacobian_ratios.min():.3g} of its mean"
        )
        return (
            f"TetQuality of {self._mesh.n_tetrahedra} tetrahedra\n"
            f"  dihedral angles {np.degrees(self.smallest_angles.min()):.1f} to "
            f"{np.degrees(self.largest_angles.max()):.1f} deg, radius ratio at least {self.radius_ratios.min():.3g}, "
            f"aspect at most {self.aspects.max():.3g}, volumes {self.volume_ratios.min():.3g} to "
            f"{self.volume_ratios.max():.3g}{bent}\n"
            f"  smallest angles: {worst}"
        )
