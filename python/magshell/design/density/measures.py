"""Volume and perimeter of a density, for constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._input.scalars import positive
from ..._input.tensors import require_torch
from ...mesh.tetrahedra.tet_mesh import TetMesh
from ...mesh.triangles.triangle_mesh import TriangleMesh
from .cells import cells_of, checked_density

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


def volume_fraction(mesh: TriangleMesh | TetMesh, density: Numbers) -> torch.Tensor:
    """Return the share of a mesh that is matter: the mean of its densities, by area, or by volume.

    As a constraint <= 0: volume_fraction(mesh, density) / limit - 1.

    mesh: of n_f faces, or of so many tetrahedra. density: (n_f,) in [0, 1].

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> round(float(ms.parametrize.density.volume_fraction(mesh, [0.25] * 40)), 9)
    0.25
    """
    torch = require_torch("parametrize.density.volume_fraction")
    sizes = torch.tensor(cells_of(mesh).sizes)
    return sizes @ checked_density("density", density, len(sizes)) / sizes.sum()


def perimeter(mesh: TriangleMesh | TetMesh, density: Numbers, smoothing: float = 1e-2) -> torch.Tensor:
    """Return the length of the borders between matter and void [m], without that of the mesh; for solids their area [m2].

    It is the total variation of the density: the integral of its gradient's magnitude, from means at the vertices. The
    magnitude is rounded at zero, sqrt(g^2 + e^2) - e. As a constraint <= 0: perimeter(mesh, density) / limit - 1.

    mesh: of n_f faces, or of so many tetrahedra. density: (n_f,) in [0, 1]. smoothing: e, in one over the mean side of a
    face.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.1, 0.02, cells=(10, 2))
    >>> left = mesh.face_barycenters[:, 0] < 0.05
    >>> round(float(ms.parametrize.density.perimeter(mesh, 1.0 * left)), 3)
    0.02
    """
    torch = require_torch("parametrize.density.perimeter")
    cells = cells_of(mesh)
    density = checked_density("density", density, len(cells.sizes))
    count = cells.nodes.shape[1]
    nodes, sizes = torch.tensor(cells.nodes, dtype=torch.int64), torch.tensor(cells.sizes)
    shares = (sizes * density / count).repeat_interleave(count)
    at_nodes = torch.zeros(len(cells.positions), dtype=density.dtype).index_add(0, nodes.ravel(), shares)
    at_nodes = (at_nodes / torch.tensor(cells.node_sizes))[nodes]
    squares = torch.einsum("fk,fkl,fl->f", at_nodes, torch.tensor(cells.slopes), at_nodes)
    rounding = positive("smoothing", "1", smoothing) / float(np.mean(cells.longest_sides))
    return sizes @ ((squares.clamp(min=0.0) + rounding**2) ** 0.5 - rounding)
