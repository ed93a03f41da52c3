"""Division of hexahedral cells and prisms into tetrahedra whose faces match between neighbours.

The eight corners of a cell are numbered in binary: corner 1 is next to corner 0 along the first axis, 2 along the second, 4
along the third. Ten-node tetrahedra of round solids get curved edges.
"""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import array_of
from ..tetrahedra.refine import curved
from ..tetrahedra.tet_mesh import TetMesh
from ..topology import MIRRORED

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


DIAGONALS = ("alternating", "aligned", "crossed")
_MOST_TETRAHEDRA = (2**31 - 1) // 4


def checked_cells(cells: Numbers, axes: tuple[str, ...]) -> tuple[int, ...]:
    """Return the numbers of cells as integers. Raises ValueError unless they are one integer of at least 1 per axis."""
    counts = array_of("cells", cells, f"be {len(axes)} integers")
    if counts.shape != (len(axes),) or not np.issubdtype(counts.dtype, np.integer) or (counts < 1).any():
        raise ValueError(
            f"cells must be {len(axes)} integers of at least 1 ({', '.join(axes)}), got {cells!r:.60}"
        )
    return tuple(counts.tolist())


def check_size(n_tetrahedra: float, asked_by: str = "cells") -> None:
    """Raise ValueError if there are more tetrahedra than 32-bit indices of their corners can number.

    asked_by: the argument that its message names.
    """
    if n_tetrahedra > _MOST_TETRAHEDRA:
        raise ValueError(
            f"{asked_by} asks for about {n_tetrahedra:.3g} tetrahedra; a mesh has at most {_MOST_TETRAHEDRA}"
        )


def check_diagonals(diagonals: str) -> None:
    """Raise ValueError unless `diagonals` is one of DIAGONALS."""
    if diagonals not in DIAGONALS:
        raise ValueError(f"diagonals must be one of {', '.join(map(repr, DIAGONALS))}, got {diagonals!r:.60}")


def check_order(order) -> int:
    """Return the order of tetrahedra. Raises ValueError unless it is 1 or 2."""
    if isinstance(order, bool) or order not in (1, 2):
        raise ValueError(f"order must be 1 (four nodes) or 2 (ten nodes), got {order!r:.60}")
    return int(order)


def lattice(
    counts: tuple[int, int, int], periodic: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the lattice of cells in the unit cube.

    counts: the numbers of cells along the axes. periodic: whether the second axis is closed into a ring.
    Returns points (n, 3), the corners (n_c, 8) of the cells, and the indices (n_c, 3) of each cell along the axes.
    """
    shape = np.array(counts) + 1
    number = np.arange(shape.prod()).reshape(shape)
    axes = [np.linspace(0, 1, n) for n in shape]
    if periodic:
        number = np.arange(shape[0] * counts[1] * shape[2]).reshape(shape[0], counts[1], shape[2])
        number = np.concatenate([number, number[:, :1]], axis=1)
        axes[1] = axes[1][:-1]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cell = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    i, j, k = cell.T
    corners = [number[i + (b & 1), j + (b >> 1 & 1), k + (b >> 2)] for b in range(8)]
    return points, np.stack(corners, axis=1), cell


def six_each(corners: np.ndarray, mirrored: np.ndarray) -> np.ndarray:
    """Divide cells with corners (n_c, 8) into six tetrahedra each, (6 n_c, 4), around the diagonal from corner 0 to 7.

    mirrored: (n_c, 3) bool, the axes along which the division of a cell is mirrored. Neighbours match if all cells are
        alike,
    and if cells alternate along an axis.
    """
    flips = mirrored @ np.array([1, 2, 4])
    tetrahedra = []
    for path in permutations((1, 2, 4)):
        steps = np.array([0, path[0], path[0] | path[1], 7])
        odd = sum(a > b for i, a in enumerate(path) for b in path[i + 1 :]) % 2
        nodes = np.take_along_axis(corners, steps[None, :] ^ flips[:, None], axis=1)
        inverted = (mirrored.sum(axis=1) + odd) % 2 == 1
        tetrahedra.append(np.where(inverted[:, None], nodes[:, MIRRORED[:4]], nodes))
    return np.stack(tetrahedra, axis=1).reshape(-1, 4)


def twenty_four_each(
    points: np.ndarray, corners: np.ndarray, corner_points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Divide cells into 24 tetrahedra each, with a new point in the middle of each cell and of each of its sides.

    corners: (n_c, 8). corner_points: (n_c, 8, 3), the corners' positions as each cell has them: along a periodic axis the
    same corner has different parameters in the first and the last cell.
    Returns all points, the given ones first, and tetrahedra (24 n_c, 4), one for each edge of each side.
    """
    sides = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)])
    rings = corners[:, sides].reshape(-1, 4)
    _, first, which = np.unique(np.sort(rings, axis=1), axis=0, return_index=True, return_inverse=True)
    middles = corner_points[:, sides].reshape(-1, 4, 3)[first].mean(axis=1)
    centers = corner_points.mean(axis=1)
    side = len(points) + which.ravel()
    center = len(points) + len(middles) + np.repeat(np.arange(len(corners)), 6)
    fans = [np.stack([rings[:, (k + 1) % 4], rings[:, k], side, center], axis=1) for k in range(4)]
    return np.concatenate([points, middles, centers]), np.stack(fans, axis=1).reshape(-1, 4)


def prisms(faces: np.ndarray, n_points: int, layers: int) -> np.ndarray:
    """Divide the prisms between layers + 1 copies of a triangulation into tetrahedra, (3 layers n_f, 4).

    Vertex v of copy k has the number v + n_points k. The diagonals of the prisms' sides run from the lower to the higher
    vertex in an order that begins with the vertices of fewest faces: so no corner of the solid consists of a single
    tetrahedron. Every other layer is mirrored.
    """
    rank = np.empty(n_points, dtype=int)
    rank[np.argsort(np.bincount(faces.ravel(), minlength=n_points), kind="stable")] = np.arange(n_points)
    a, b, c = np.take_along_axis(faces, np.argsort(rank[faces], axis=1), axis=1).T
    stacked = []
    for layer in range(layers):
        below, above = (layer, layer + 1) if layer % 2 == 0 else (layer + 1, layer)
        low, high = below * n_points, above * n_points
        rows = [
            (a + low, b + low, c + low, c + high),
            (a + low, b + low, b + high, c + high),
            (a + low, a + high, b + high, c + high),
        ]
        stacked.append(np.transpose(rows, (2, 0, 1)).reshape(-1, 4))
    return np.concatenate(stacked)


def oriented(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return the same tetrahedra with their nodes reordered where needed, so that all volumes are positive."""
    a, b, c = np.moveaxis(points[tetrahedra[:, 1:]] - points[tetrahedra[:, :1]], 1, 0)
    inverted = np.einsum("ti,ti->t", np.cross(a, b), c) < 0
    return np.where(inverted[:, None], tetrahedra[:, MIRRORED[:4]], tetrahedra)


def round_order(mesh: TetMesh, order: int, axes: tuple[int, ...]) -> TetMesh:
    """Return the mesh with tetrahedra of the given order, 1 or 2, whose curved edges follow round surfaces.

    The distance of a midside node from the origin, measured in the coordinates `axes`, is the mean of the distances of the
    edge's ends. So an edge on a cylinder or a sphere around the origin becomes an arc.
    """
    if order == 1:
        return mesh
    across = list(axes)
    radii = np.linalg.norm(mesh.rest_positions[:, across], axis=1)

    def project(midpoints: np.ndarray, edges: np.ndarray) -> np.ndarray:
        projected = midpoints.copy()
        wanted, current = radii[edges].mean(axis=1), np.linalg.norm(midpoints[:, across], axis=1)
        factor = np.divide(wanted, current, out=np.ones_like(wanted), where=current > 1e-9 * wanted)
        projected[:, across] *= factor[:, None]
        return projected

    return curved(mesh, project)
