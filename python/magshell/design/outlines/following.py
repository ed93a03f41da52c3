"""Rest positions of a sheet whose boundary is given, or displaced by the control points of a closed spline.

The inner vertices follow by harmonic displacements.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._input.tensors import real_tensor, require_torch
from ...mesh.triangles.triangle_mesh import TriangleMesh, checked_mesh
from .borders import LEAST_CONTROLS, closed_spline

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def with_boundary(mesh: TriangleMesh, boundary: Numbers) -> torch.Tensor:
    """Return rest positions (n_v, 3) m with a given boundary, whose inner vertices follow smoothly.

    The displacements of the inner vertices are harmonic functions of those of the boundary, by linear elements (cotangent
    weights; Pinkall, Polthier 1993), so that a boundary that is stretched or turned takes the inside along exactly.

    mesh: a TriangleMesh with a boundary. boundary: (k, 3) m, the new positions of `mesh.boundary_vertices`.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> twice = ms.parametrize.with_boundary(mesh, 2.0 * mesh.rest_positions[mesh.boundary_vertices])
    >>> bool(abs(twice.numpy() - 2.0 * mesh.rest_positions).max() < 1e-12)
    True
    """
    require_torch("parametrize.with_boundary")
    mesh = checked_mesh(mesh)
    border = mesh.boundary_vertices
    if not len(border):
        raise ValueError("mesh must have a boundary, but it is a closed surface")
    return HarmonicInside(mesh)(real_tensor("boundary [m]", boundary, (len(border), 3)).double())


class HarmonicInside:
    """The linear map from positions of the boundary of a mesh to those of all vertices, factorized once.

    mesh: with a boundary. Called with a tensor (k, 3) m.
    """

    def __init__(self, mesh: TriangleMesh):
        self._mesh = mesh
        self._start = np.array(mesh.rest_positions)
        self._border = np.array(mesh.boundary_vertices, dtype=np.int64)
        self._inner = np.setdiff1d(np.arange(mesh.n_vertices), self._border)
        if len(self._inner):
            stiffness = _laplacian(mesh)
            self._factor = scipy.sparse.linalg.splu(stiffness[self._inner][:, self._inner].tocsc())
            self._coupling = stiffness[self._inner][:, self._border].tocsr()

    def __call__(self, boundary: torch.Tensor) -> torch.Tensor:
        """Return the positions of all vertices (n_v, 3) m, differentiable."""
        torch = require_torch("parametrize.with_boundary")
        from ...solve.adjoint.autograd import linear_map

        start, rows = torch.tensor(self._start), torch.tensor(self._border)
        moved = boundary - start[rows]
        displacements = torch.zeros_like(start).index_copy(0, rows, moved)
        if not len(self._inner):
            return start + displacements
        following = linear_map(self._inside, self._transposed, moved)
        return start + displacements.index_copy(0, torch.tensor(self._inner), following)

    def __reduce__(self) -> tuple[type[HarmonicInside], tuple[TriangleMesh]]:
        """Make a copy by a factorization of its own."""
        return HarmonicInside, (self._mesh,)

    def positions(self, boundary: np.ndarray) -> np.ndarray:
        """Return the positions of all vertices (n_v, 3) m as an array."""
        found = self._start.copy()
        moved = boundary - found[self._border]
        found[self._border] = boundary
        if len(self._inner):
            found[self._inner] += self._inside(moved)
        return found

    def _inside(self, of_border: np.ndarray) -> np.ndarray:
        return -self._factor.solve(self._coupling @ of_border)

    def _transposed(self, of_inner: np.ndarray) -> np.ndarray:
        return -(self._coupling.T @ self._factor.solve(np.ascontiguousarray(of_inner), "T"))


def _laplacian(mesh: TriangleMesh) -> scipy.sparse.csr_array:
    """Return the matrix of the integrals of products of gradients of linear shape functions, (n_v, n_v)."""
    corners = mesh.rest_positions[mesh.faces]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    products = np.einsum("fki,fli->fkl", edges, edges) / (4.0 * mesh.face_areas[:, None, None])
    rows, columns = np.repeat(mesh.faces, 3, axis=1).ravel(), np.tile(mesh.faces, (1, 3)).ravel()
    shape = (mesh.n_vertices, mesh.n_vertices)
    return scipy.sparse.coo_array((products.ravel(), (rows, columns)), shape=shape).tocsr()


def outline(mesh: TriangleMesh, controls: Numbers, loop: int = 0) -> torch.Tensor:
    """Return rest positions (n_v, 3) m of a sheet whose outline is displaced by control points.

    The control points are those of a closed uniform cubic B-spline, at equal distances along the boundary; the first is
    at `mesh.boundary_loops[loop][0]`. The displacement of the boundary is that spline, other boundaries stay, and inner
    vertices follow as in `with_boundary`.

    mesh: a TriangleMesh with a boundary. controls: (k, 3) m, displacements of at least four control points. loop: the
        number of the boundary.

    >>> import magshell as ms
    >>> mesh = ms.meshes.disk(0.05, cells=5)
    >>> raised = ms.parametrize.outline(mesh, [[0, 0, 0.01]] * 6)  # all alike: the disk moves as a whole
    >>> bool(abs(raised.numpy() - mesh.rest_positions - (0, 0, 0.01)).max() < 1e-12)
    True
    """
    torch = require_torch("parametrize.outline")
    mesh = checked_mesh(mesh)
    controls = real_tensor("controls [m]", controls, ("k", 3)).double()
    if len(controls) < LEAST_CONTROLS:
        raise ValueError(f"controls [m] must have at least {LEAST_CONTROLS} rows, got {len(controls)}")
    loops = mesh.boundary_loops
    if isinstance(loop, bool) or not isinstance(loop, int | np.integer) or not 0 <= loop < len(loops):
        raise ValueError(f"loop must be one of the {len(loops)} boundaries of the mesh, from 0, got {loop!r}")
    vertices = loops[loop]
    places = mesh.rest_positions[vertices]
    lengths = np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) / lengths.sum() * len(controls)
    moved = torch.as_tensor(closed_spline(at, len(controls))) @ controls
    border = mesh.boundary_vertices
    rows = torch.as_tensor(np.searchsorted(border, vertices))
    start = torch.tensor(mesh.rest_positions[border])
    return with_boundary(mesh, start + torch.zeros_like(start).index_copy(0, rows, moved))
