"""Obstacles bounded by closed triangle meshes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from .... import _core as core
from ....mesh.io.read_write import read_mesh
from ....mesh.triangles.triangle_mesh import TriangleMesh
from ....mesh.triangles.winding_numbers import winding_numbers
from .obstacle import NO_MIDDLE, Obstacle, Surface

if TYPE_CHECKING:
    from ...._input.kinds import Numbers
    from ....mesh.triangles.six_node_mesh import QuadraticTriangleMesh


MOST_CELLS = 256  # largest resolution; 140 MB of samples
SAME_PLACE = 1e-9  # [-] of the mesh's size: vertices nearer to each other have the same position


_GRID = 7  # points along each axis among which the deepest is sought


class MeshObstacle(Obstacle):
    """The body inside a closed triangle mesh whose normals point outwards.

    The exact signed distance to the mesh is sampled on a regular grid and interpolated by tricubic splines. The obstacle is
    bounded by the zero surface of the interpolation, and the distance to that is exact. Where the mesh is smooth, it is
    reproduced to a small fraction of a cell; edges and corners are rounded within about a cell, and parts thinner than two
    cells are lost. A cell is the longest side of the mesh over the resolution: 64 takes a second and 3 MB, and both grow
    with its cube.

    Farther than 4 cells from the mesh the distance is that to its bounding box, which is never larger.

    Args:
        mesh: a TriangleMesh, a file that `read_mesh` reads, or vertices (n_v, 3) m of `faces`.
        faces: (n_f, 3) vertex indices, where `mesh` is an array.
        resolution: cells along the longest side, 4 to 256.
        center, rotation, motion: see Obstacle.

    Raises ValueError, before any work, on a mesh that is open, inside out, not manifold, that touches itself at
    vertices or encloses no volume, saying where.

    >>> import numpy as np
    >>> import magshell as ms
    >>> ball = ms.meshes.spherical_cap(1.0, 0.0, np.pi, cells=(32, 16))
    >>> MeshObstacle(ball, resolution=16)
    MeshObstacle(960 faces, 2 x 2 x 2 m, 16 cells along the longest side)
    """

    def __init__(
        self,
        mesh: TriangleMesh | QuadraticTriangleMesh,
        faces: Numbers | None = None,
        resolution: int = 64,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        if isinstance(resolution, bool) or not isinstance(resolution, int | np.integer):
            raise ValueError(f"resolution must be an integer, got {resolution!r:.60}")
        if not 4 <= resolution <= MOST_CELLS:
            raise ValueError(f"resolution must lie between 4 and {MOST_CELLS}, got {resolution}")
        self.mesh: TriangleMesh = _mesh_of(mesh, faces)
        _check_closed(self.mesh)
        _check_orientation(self.mesh)
        self.resolution: int = int(resolution)
        self._of(
            core.Obstacle.mesh(self.mesh._core, self.resolution), mesh=self.mesh, resolution=self.resolution
        )

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return self.mesh.rest_positions, self.mesh.faces

    @cached_property
    def _middle(self) -> tuple[np.ndarray, float]:
        """The deepest point of a coarse grid."""
        places = self.mesh.rest_positions
        axes = np.linspace(places.min(axis=0), places.max(axis=0), _GRID).T
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        distances, _, _ = core.distances(self._core, grid)
        deepest = int(np.argmin(distances))
        radius = float(np.sort(np.ptp(places, axis=0))[1]) / 2
        return (grid[deepest : deepest + 1], radius) if distances[deepest] < 0.0 else NO_MIDDLE

    def _summary(self) -> str:
        size = " x ".join(f"{length:.4g}" for length in np.ptp(self.mesh.rest_positions, axis=0))
        return f"{self.mesh.n_faces} faces, {size} m, {self.resolution} cells along the longest side"


def _mesh_of(mesh, faces) -> TriangleMesh:
    if faces is not None:
        if isinstance(mesh, TriangleMesh | str | PathLike):
            raise ValueError(f"faces belong to an array of vertices; {type(mesh).__name__} has its own")
        return TriangleMesh(mesh, faces)
    if isinstance(mesh, TriangleMesh):
        return mesh
    if isinstance(mesh, str | PathLike):
        return read_mesh(mesh)
    raise ValueError(
        f"mesh must be a TriangleMesh, the name of a file, or vertices (n_v, 3) [m] together with faces, got "
        f"{type(mesh).__name__}"
    )


def _check_closed(mesh: TriangleMesh) -> None:
    x = mesh.rest_positions
    pairs = scipy.spatial.cKDTree(x).query_pairs(SAME_PLACE * mesh.size, output_type="ndarray")
    same = ""
    if len(pairs):
        a, b = pairs[np.lexsort(pairs.T[::-1])[0]].tolist()
        same = f"vertices {a} and {b} are both at {_at(x[a])}"
    if len(mesh.boundary_edges):
        a, b = mesh.edges[mesh.boundary_edges[0]].tolist()
        count = len(mesh.boundary_edges)
        edges = "1 edge has" if count == 1 else f"{count} edges have"
        remedy = f"{same}: make them one" if same else "close it"
        raise ValueError(
            f"the obstacle's mesh is open: {edges} one face only, the first from vertex {a} at {_at(x[a])} to vertex {b} "
            f"at {_at(x[b])}; {remedy}"
        )
    if same:
        raise ValueError(f"the obstacle's mesh touches itself: {same}; make one body of the parts that touch")


def _check_orientation(mesh: TriangleMesh) -> None:
    """Raise ValueError if a part is inside out, or lies inside another without being a hollow, or has no volume."""
    x = mesh.rest_positions
    part = mesh.components[mesh.faces[:, 0]]
    for k in range(mesh.n_components):
        faces = mesh.faces[part == k]
        volume = _volume(x[faces])
        which = "the obstacle's mesh" if mesh.n_components == 1 else f"part {k} of the obstacle's mesh"
        if abs(volume) <= 1e-9 * np.linalg.norm(np.ptp(x[faces.ravel()], axis=0)) ** 3:
            raise ValueError(f"{which} encloses no volume: {volume:.3g} m3, near {_at(x[faces[0, 0]])}")
        around = winding_numbers(x[faces[0, :1]], x[mesh.faces[part != k]])[0]
        where = f"near vertex {faces[0, 0]} at {_at(x[faces[0, 0]])}"
        if volume < 0 and around < 0.5:
            raise ValueError(
                f"{which} is inside out, {where}: its normals point inwards; turn it with .flipped()"
            )
        if volume > 0 and around > 0.5:
            raise ValueError(
                f"{which} lies inside another part, {where}: leave it out, or turn it with .flipped() to make it a hollow"
            )


def _volume(corners: np.ndarray) -> float:
    """Return the volume enclosed by triangles (m, 3, 3) m, m3."""
    relative = corners - corners.mean(axis=(0, 1))
    return float(np.linalg.det(relative).sum() / 6)


def _at(point: np.ndarray) -> str:
    return f"({', '.join(f'{x:g}' for x in point)})"
