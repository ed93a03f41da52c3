"""The generator of balls of tetrahedra."""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np

from ..._input.arrays import count
from ..._input.scalars import positive
from ..._runtime.solver_entry_point import grouped
from ..tetrahedra.tet_mesh import TetMesh
from ._tet_cells import check_order, check_size, oriented, round_order


@grouped()
def ball(radius: float, cells: int, order: int = 1) -> TetMesh:
    """Build a ball around the origin from 20 cells^3 nearly regular tetrahedra.

    The twenty tetrahedra between the center and the faces of an icosahedron are divided evenly, then mapped so that layer k
    of `cells` lies on a sphere.

    Args:
        radius: m.
        cells: the number of cells from the center to the surface.
        order: 1 for four nodes; 2 for ten, with the midside nodes of surface edges on the sphere.

    >>> ball(0.01, cells=4).n_tetrahedra
    1280
    """
    radius, cells = positive("radius", "m", radius), count("cells", cells)
    order = check_order(order)
    check_size(20.0 * cells**3)
    outer, triangles = _icosahedron()
    lattice, small = _divided(cells)
    # integer weights of the twelve outer corners: a point gets the same ones in all of the twenty tetrahedra it belongs to
    weights = np.zeros((len(triangles), len(lattice), 12), dtype=np.int32)
    for i in range(3):
        np.put_along_axis(
            weights,
            np.broadcast_to(triangles[:, i, None, None], (20, len(lattice), 1)),
            lattice[None, :, i, None],
            axis=2,
        )
    distinct, which = np.unique(weights.reshape(-1, 12), axis=0, return_inverse=True)
    layer = distinct.sum(axis=1)
    direction = distinct @ outer
    length = np.linalg.norm(direction, axis=1)
    points = (
        direction
        * np.divide(radius * layer / cells, length, out=np.zeros_like(length), where=length > 0)[:, None]
    )
    which = which.reshape(20, len(lattice))
    tetrahedra = which[:, small].reshape(-1, 4)
    return round_order(TetMesh(points, oriented(points, tetrahedra)), order, axes=(0, 1, 2))


def _icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (12, 3) of an icosahedron, of unit length, and its triangles (20, 3) of either orientation."""
    golden = 0.5 * (1 + np.sqrt(5))
    corners = np.array(
        [np.roll((0.0, s, t * golden), shift) for shift in range(3) for s in (-1, 1) for t in (-1, 1)]
    )
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 2.1
    triangles = [f for f in combinations(range(12), 3) if all(near[a, b] for a, b in combinations(f, 2))]
    return corners / np.linalg.norm(corners[0]), np.array(triangles)


def _divided(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Divide a tetrahedron into n^3 small ones.

    Returns the barycentric weights (k, 3) of corners 1 to 3 at each point, in units of 1 / n, and the small tetrahedra
    (n^3, 4). The points are those with n >= x >= y >= z >= 0 of a cubic lattice. The small tetrahedra are those of the six
    around the diagonal of each cube that lie in this region. Two tetrahedra divide a common face in the same way.
    """
    x, y, z = np.meshgrid(*[np.arange(n + 1)] * 3, indexing="ij")
    inside = (x >= y) & (y >= z)
    number = np.where(inside, np.cumsum(inside).reshape(inside.shape) - 1, -1)
    x, y, z = x[inside], y[inside], z[inside]
    base = np.stack([x, y, z], axis=1)[x < n]
    small = []
    for path in permutations(np.eye(3, dtype=int)):
        steps = np.cumsum([np.zeros(3, dtype=int), *path], axis=0)
        at = base[:, None, :] + steps
        within = (
            (at.max(axis=(1, 2)) <= n)
            & (at[..., 0] >= at[..., 1]).all(axis=1)
            & (at[..., 1] >= at[..., 2]).all(axis=1)
        )
        small.append(number[tuple(np.moveaxis(at[within], 2, 0))])
    return np.stack([x - y, y - z, z], axis=1), np.concatenate(small)
