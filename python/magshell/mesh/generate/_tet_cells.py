"""Cells with eight corners, and prisms, divided into tetrahedra that fit together.

Eight corners are numbered in binary: corner 1 is the next along the first axis, 2 along the second, 4 along the third.
"""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from ..._input.quantity import array_of
from ..topology import MIRRORED

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


DIAGONALS = ("alternating", "aligned", "crossed")
_MOST_TETRAHEDRA = (2**31 - 1) // 4


def checked_cells(cells: Numbers, axes: tuple[str, ...]) -> tuple[int, ...]:
    counts = array_of("cells", cells, f"be {len(axes)} integers")
    if counts.shape != (len(axes),) or not np.issubdtype(counts.dtype, np.integer) or (counts < 1).any():
        raise ValueError(
            f"cells must be {len(axes)} integers of at least 1 ({', '.join(axes)}), got {cells!r:.60}"
        )
    return tuple(counts.tolist())


def check_size(n_tetrahedra: float, asked_by: str = "cells") -> None:
    """Refuses more tetrahedra than 32-bit indices of their corners can count."""
    if n_tetrahedra > _MOST_TETRAHEDRA:
        raise ValueError(
            f"{asked_by} asks for about {n_tetrahedra:.3g} tetrahedra; a mesh has at most {_MOST_TETRAHEDRA}"
        )


def check_diagonals(diagonals: str) -> None:
    if diagonals not in DIAGONALS:
        raise ValueError(f"diagonals must be one of {', '.join(map(repr, DIAGONALS))}, got {diagonals!r:.60}")


def check_order(order) -> int:
    if isinstance(order, bool) or order not in (1, 2):
        raise ValueError(f"order must be 1 (four nodes) or 2 (ten nodes), got {order!r:.60}")
    return int(order)


def lattice(
    counts: tuple[int, int, int], periodic: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3) in the unit cube, corners (n_c, 8) of its cells, and the numbers of each along the axes (n_c, 3).

    periodic: the second axis closes on itself.
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
    """(6 n_c, 4) from corners (n_c, 8): six around the diagonal from corner 0 to 7 of each cell.

    mirrored: (n_c, 3) bool, along which axes a cell is the mirror image of that. Neighbours fit together where all are
    alike, and where each axis alternates.
    """
    turned = mirrored @ np.array([1, 2, 4])
    tetrahedra = []
    for path in permutations((1, 2, 4)):
        steps = np.array([0, path[0], path[0] | path[1], 7])
        odd = sum(a > b for i, a in enumerate(path) for b in path[i + 1 :]) % 2
        nodes = np.take_along_axis(corners, steps[None, :] ^ turned[:, None], axis=1)
        inverted = (mirrored.sum(axis=1) + odd) % 2 == 1
        tetrahedra.append(np.where(inverted[:, None], nodes[:, MIRRORED[:4]], nodes))
    return np.stack(tetrahedra, axis=1).reshape(-1, 4)


def twenty_four_each(
    points: np.ndarray, corners: np.ndarray, corner_points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points with those in the middle of cells and of their sides, and (24 n_c, 4): one on each edge of each side.

    corner_points: (n_c, 8, 3), where each cell sees its corners, which on a closed axis is not where its neighbour does.
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
    """(3 layers n_f, 4): prisms between copies of a triangulation, (layers + 1) of them, each with n_points more.

    The sides of prisms are cut from the lower to the higher vertex of an order that begins with the vertices of fewest
    faces, so that no corner of the solid is cut off by a single tetrahedron; every other layer is mirrored.
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


def turned(points: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The same tetrahedra with positive volumes."""
    a, b, c = np.moveaxis(points[tetrahedra[:, 1:]] - points[tetrahedra[:, :1]], 1, 0)
    inverted = np.einsum("ti,ti->t", np.cross(a, b), c) < 0
    return np.where(inverted[:, None], tetrahedra[:, MIRRORED[:4]], tetrahedra)
