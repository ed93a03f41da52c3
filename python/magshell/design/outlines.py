"""Outlines of sheets by a few control points, with an inner mesh that follows smoothly, as functions of torch tensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from .._input.tensors import real_tensor, require_torch
from ..mesh.triangles.triangle_mesh import TriangleMesh, checked_mesh

if TYPE_CHECKING:
    import torch

    from .._input.kinds import Numbers

_FEWEST = 4  # control points of a closed cubic spline


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
    torch = require_torch("parametrize.with_boundary")
    from ..solve.adjoint.autograd import linear_map

    mesh = checked_mesh(mesh)
    border = np.array(mesh.boundary_vertices, dtype=np.int64)
    if not len(border):
        raise ValueError("mesh must have a boundary, but it is a closed surface")
    boundary = real_tensor("boundary [m]", boundary, (len(border), 3)).double()
    start = torch.tensor(mesh.rest_positions)
    rows = torch.tensor(border)
    moved = boundary - start[rows]
    inner = np.setdiff1d(np.arange(mesh.n_vertices), border)
    displacements = torch.zeros_like(start).index_copy(0, rows, moved)
    if not len(inner):
        return start + displacements
    stiffness = _laplacian(mesh)
    factor = scipy.sparse.linalg.splu(stiffness[inner][:, inner].tocsc())
    coupling = stiffness[inner][:, border].tocsr()
    following = linear_map(
        lambda of_border: -factor.solve(coupling @ of_border),
        lambda of_inner: -(coupling.T @ factor.solve(np.ascontiguousarray(of_inner), "T")),
        moved,
    )
    return start + displacements.index_copy(0, torch.tensor(inner), following)


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
    if len(controls) < _FEWEST:
        raise ValueError(f"controls [m] must have at least {_FEWEST} rows, got {len(controls)}")
    loops = mesh.boundary_loops
    if isinstance(loop, bool) or not isinstance(loop, int | np.integer) or not 0 <= loop < len(loops):
        raise ValueError(f"loop must be one of the {len(loops)} boundaries of the mesh, from 0, got {loop!r}")
    vertices = loops[loop]
    places = mesh.rest_positions[vertices]
    lengths = np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) / lengths.sum() * len(controls)
    moved = torch.as_tensor(_closed_spline(at, len(controls))) @ controls
    border = mesh.boundary_vertices
    rows = torch.as_tensor(np.searchsorted(border, vertices))
    start = torch.tensor(mesh.rest_positions[border])
    return with_boundary(mesh, start + torch.zeros_like(start).index_copy(0, rows, moved))


def _closed_spline(at: np.ndarray, count: int) -> np.ndarray:
    """Return the closed uniform cubic B-splines of `count` control points at parameters (n,) in [0, count), (n, count)."""
    first, t = np.floor(at).astype(int), at - np.floor(at)
    weights = np.stack(
        [(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1
    )
    splines = np.zeros((len(at), count))
    for k in range(4):
        np.add.at(splines, (np.arange(len(at)), (first + k - 1) % count), weights[:, k] / 6.0)
    return splines


def _laplacian(mesh: TriangleMesh) -> scipy.sparse.csr_array:
    """Return the matrix of the integrals of products of gradients of linear shape functions, (n_v, n_v)."""
    corners = mesh.rest_positions[mesh.faces]
    edges = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    products = np.einsum("fki,fli->fkl", edges, edges) / (4.0 * mesh.face_areas[:, None, None])
    rows, columns = np.repeat(mesh.faces, 3, axis=1).ravel(), np.tile(mesh.faces, (1, 3)).ravel()
    shape = (mesh.n_vertices, mesh.n_vertices)
    return scipy.sparse.coo_array((products.ravel(), (rows, columns)), shape=shape).tocsr()
