"""The base class of triangle meshes and tetrahedral meshes."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .._runtime.mixins import PlotMixin
from .group_selection import GroupSelection


class MeshBase(PlotMixin, GroupSelection):
    """Base class of meshes: counts and lengths that follow from rest_positions, edges, faces and components."""

    @property
    def n_vertices(self) -> int:
        return len(self.rest_positions)

    @property
    def n_faces(self) -> int:
        return len(self.faces)

    @property
    def n_edges(self) -> int:
        return len(self.edges)

    @property
    def n_components(self) -> int:
        return int(self.components.max()) + 1

    @cached_property
    def size(self) -> float:
        """The diagonal of the bounding box, m; default tolerances are relative to this length."""
        return float(np.linalg.norm(np.ptp(self.rest_positions, axis=0)))

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """The straight distances between the ends of the edges, (n_e,) m."""
        ends = self.rest_positions[self.edges]
        return frozen(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @cached_property
    def edge_midpoints(self) -> np.ndarray:
        """The points halfway between the ends of the edges, (n_e, 3) m.

        The midside nodes of ten-node tetrahedra may lie elsewhere.
        """
        return frozen(self.rest_positions[self.edges].mean(axis=1))


def width_of(mesh: MeshBase) -> float:
    """Return a mesh's width in the rest shape, m: twice the largest distance of a vertex from the center of the
    surface.

    For a rectangle and a box that is the diagonal. Rotations keep it, which change the sides of a bounding box.
    """
    corners = mesh.rest_positions[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    middle = areas @ corners.mean(axis=1) / areas.sum()
    return 2.0 * float(np.linalg.norm(mesh.rest_positions - middle, axis=1).max())


def frozen(array: np.ndarray) -> np.ndarray:
    """Return the same array, made read-only."""
    array.setflags(write=False)
    return array
