"""Quality measures of the faces of a mesh."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..._runtime.frozen import Frozen
from ..mesh_base import frozen

if TYPE_CHECKING:
    from .six_node_mesh import QuadraticTriangleMesh
    from .triangle_mesh import TriangleMesh


class MeshQuality(Frozen):
    """The quality measures of a mesh's faces in the reference configuration, as arrays (n_f,); `print` shows extremes.

    A face with an angle near 180 degrees is a *cap*. Where a shell bends along the long edge of a cap, the cap stretches
    instead of bending (membrane locking), the more so the thinner the shell is; a solve warns if that matters. *Needles*,
    long thin faces with two angles near 90 degrees, are harmless.

    >>> import magshell as ms
    >>> ms.meshes.rectangle(0.1, 0.02, cells=(10, 2)).quality
    MeshQuality of 40 faces
      angles 45.0 to 90.0 deg, aspect at most 1.39, shortest height 0.00707 m
      largest angles: 90.0 deg (face 0), 90.0 deg (face 1), 90.0 deg (face 2)
    """

    def __init__(self, mesh: TriangleMesh | QuadraticTriangleMesh, thickness: np.ndarray | None = None):
        self._mesh = mesh
        self.thickness = thickness

    @cached_property
    def _sorted_edges(self) -> np.ndarray:
        """The edge lengths of each face in ascending order, (3, n_f) m."""
        return np.sort(self._mesh.edge_lengths[self._mesh.face_edges], axis=1).T

    def _angles(self, opposite: int) -> np.ndarray:
        """Compute the angle of each face opposite its shortest (0), middle (1) or longest (2) edge, (n_f,) rad."""
        squares = self._sorted_edges**2
        # b c sin = 2 A,   b c cos = (b^2 + c^2 - a^2) / 2
        return np.arctan2(2 * self._mesh.face_areas, 0.5 * (squares.sum(axis=0) - 2 * squares[opposite]))

    @cached_property
    def smallest_angles(self) -> np.ndarray:
        """The smallest angle of each face, (n_f,) rad."""
        return frozen(self._angles(opposite=0))

    @cached_property
    def largest_angles(self) -> np.ndarray:
        """The largest angle of each face, (n_f,) rad."""
        return frozen(self._angles(opposite=2))

    @cached_property
    def aspects(self) -> np.ndarray:
        """The aspect ratio of each face, (n_f,): longest edge over inscribed radius, divided by 2 sqrt(3).

        It is 1 for an equilateral triangle.
        """
        lengths = self._sorted_edges
        inscribed_radius = 2 * self._mesh.face_areas / lengths.sum(axis=0)
        return frozen(lengths[2] / (2 * np.sqrt(3) * inscribed_radius))

    @cached_property
    def heights(self) -> np.ndarray:
        """The shortest height of each face, that on its longest edge, (n_f,) m."""
        return frozen(2 * self._mesh.face_areas / self._sorted_edges[2])

    @cached_property
    def heights_over_lengths(self) -> np.ndarray:
        """The shortest height of each face over its longest edge, (n_f,): 0.87 if equilateral, 0 if degenerate."""
        return frozen(self.heights / self._sorted_edges[2])

    @cached_property
    def heights_over_thickness(self) -> np.ndarray:
        """The shortest height of each face over the thickness of the shell, (n_f,).

        Raises ValueError for the quality of a mesh, which has no thickness.
        """
        if self.thickness is None:
            raise ValueError("a mesh has no thickness: ask the `quality` of a Shell")
        return frozen(self.heights / self.thickness)

    def worst(self, count: int = 3) -> np.ndarray:
        """Return the `count` faces with the largest angles, worst first; of equal ones, the lowest number first."""
        return np.argsort(-np.round(self.largest_angles, 9), kind="stable")[:count]

    def __repr__(self) -> str:
        thickness = (
            "" if self.thickness is None else f" ({self.heights_over_thickness.min():.3g} of the thickness)"
        )
        worst = ", ".join(f"{np.degrees(self.largest_angles[f]):.1f} deg (face {f})" for f in self.worst())
        return (
            f"MeshQuality of {len(self.heights)} faces\n"
            f"  angles {np.degrees(self.smallest_angles.min()):.1f} to {np.degrees(self.largest_angles.max()):.1f} deg, "
            f"aspect at most {self.aspects.max():.3g}, shortest height {self.heights.min():.3g} m{thickness}\n"
            f"  largest angles: {worst}"
        )
