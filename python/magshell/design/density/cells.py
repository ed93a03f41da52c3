"""The faces of a sheet and the tetrahedra of a solid as cells that have a density each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ..._input.tensors import real_tensor
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    import torch

_ROUNDING = 1e-9  # [-] by which a density may lie outside [0, 1]


class Cells(NamedTuple):
    """The cells of a mesh, triangles or tetrahedra.

    positions: of all nodes, (n_v, 3) m. nodes: of each cell, (n, k) with k = 3 or 4. sizes: areas m2 or volumes m3, (n,).
    centers: barycenters, (n, 3) m.
    """

    positions: np.ndarray
    nodes: np.ndarray
    sizes: np.ndarray
    centers: np.ndarray

    @property
    def slopes(self) -> np.ndarray:
        """The scalar products of the gradients of the k linear shape functions of each cell, (n, k, k) 1/m2."""
        corners = self.positions[self.nodes]
        sides = corners[:, 1:] - corners[:, :1]
        inverse = np.linalg.inv(sides @ np.swapaxes(sides, 1, 2))
        count = self.nodes.shape[1] - 1
        signs = np.concatenate([-np.ones((1, count)), np.eye(count)])
        return signs @ inverse @ signs.T

    @property
    def longest_sides(self) -> np.ndarray:
        """The longest side of each cell, (n,) m."""
        corners = self.positions[self.nodes]
        return np.linalg.norm(corners[:, :, None] - corners[:, None], axis=3).max(axis=(1, 2))

    @property
    def node_sizes(self) -> np.ndarray:
        """The share of each node in the sizes of its cells, (n_v,) m2 or m3."""
        shares = np.repeat(self.sizes / self.nodes.shape[1], self.nodes.shape[1])
        return np.bincount(self.nodes.ravel(), shares, minlength=len(self.positions))


def cells_of(mesh: Any) -> Cells:
    """Return the cells of a mesh. Raises ValueError if it has none with a density: curved elements and other objects."""
    if isinstance(mesh, TriangleMesh):
        return Cells(mesh.rest_positions, mesh.faces, mesh.face_areas, mesh.face_barycenters)
    if isinstance(mesh, TetMesh) and mesh.order == 1:
        return Cells(mesh.rest_positions, mesh.tetrahedra, mesh.volumes, mesh.tetrahedron_barycenters)
    got = "one of ten-node tetrahedra" if isinstance(mesh, TetMesh) else type(mesh).__name__
    raise ValueError(f"mesh must be a TriangleMesh or a TetMesh of four-node tetrahedra, got {got}")


def checked_density(name: str, values: Any, count: int | str) -> torch.Tensor:
    """Return densities (count,) as a tensor of doubles. Raises ValueError if one is outside [0, 1]; round-off is allowed."""
    density = real_tensor(f"{name} [1]", values, (count,)).double()
    numbers = density.detach()
    outside = ~((numbers >= -_ROUNDING) & (numbers <= 1.0 + _ROUNDING))
    if outside.any():
        k = int(outside.nonzero()[0, 0])
        raise ValueError(f"{name} [1] must lie within 0 and 1, but entry {k} is {float(numbers[k]):g}")
    return density


def laplacian(cells: Cells) -> scipy.sparse.csr_array:
    """Return the stiffness matrix of the negative Laplacian by linear elements, (n_v, n_v).

    Positive entries beside the diagonal, which obtuse angles cause, are set to zero. The diagonal then makes the sum of each
    row zero. So the matrix is positive semidefinite, and solutions obey a maximum principle.
    """
    count = cells.nodes.shape[1]
    rows, columns = np.repeat(cells.nodes, count, axis=1).ravel(), np.tile(cells.nodes, (1, count)).ravel()
    products = (cells.sizes[:, None, None] * cells.slopes).ravel()
    shape = (len(cells.positions), len(cells.positions))
    full = scipy.sparse.coo_array((products, (rows, columns)), shape=shape).tocsr()
    beside = (full - scipy.sparse.diags_array(full.diagonal())).minimum(0.0)
    return beside - scipy.sparse.diags_array(beside.sum(axis=1))
