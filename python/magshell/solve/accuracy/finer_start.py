"""The deformed positions of a coarse mesh on a finer one, from which the equilibrium there is found."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from ...mesh.finer import FinerMesh


def positions_on(finer: FinerMesh, positions: np.ndarray) -> np.ndarray:
    """Return the deformed positions of the finer mesh, (n_v, 3) m, from those of the coarse one.

    The offset of a new vertex from the straight edge of three-node faces at rest turns with the faces beside the edge. Thus
    the finer mesh is stretched as the coarse one. Vertices on a smooth curve through the deformed ones would stretch the
    edges by a fraction of their curvature, which buckles thin sheets. Six-node elements and
    solids keep their curved shape.
    """
    mesh, new = finer.coarse, slice(finer.coarse.n_vertices, None)
    found = finer.interpolation @ positions
    offsets = (finer.mesh.rest_positions - finer.interpolation @ mesh.rest_positions)[new]
    turns = isinstance(mesh, TriangleMesh)
    found[new] += _turned(offsets, mesh, positions, finer.new_edges) if turns else offsets
    return found


def _turned(vectors: np.ndarray, mesh: TriangleMesh, positions: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return vectors (k, 3) at edges at rest, turned with the mean of the frames of the faces beside them."""
    before, after = (_frames(mesh, at, edges) for at in (mesh.rest_positions, positions))
    return np.einsum("kai,kaj,kj->ki", after, before, vectors)


def _frames(mesh: TriangleMesh, positions: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return orthonormal rows (k, 3, 3) at edges: along the edge, across it in the sheet, and the normal."""
    ends = positions[mesh.edges[edges]]
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    areas = mesh._area_vectors_at(positions)
    sides = mesh.edge_faces[edges]
    normal = np.where(sides >= 0, 1.0, 0.0)[:, :, None] * areas[sides]
    normal = normal.sum(axis=1)
    normal -= np.einsum("ki,ki->k", normal, along)[:, None] * along
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([along, np.cross(normal, along), normal], axis=1)
