"""Rest positions of a sheet whose outline is displaced by the control points of a closed spline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.tensors import real_tensor, require_torch
from ...mesh.triangles.triangle_mesh import TriangleMesh, checked_mesh
from .borders import LEAST_CONTROLS, closed_spline
from .following import with_boundary

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


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
