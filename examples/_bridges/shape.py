"""Two bridges of hexahedral cells cut into tetrahedra, with about the sizes and counts of those of [Qiao21].

Cells of a lattice are selected by their indices; then the levels of z are mapped to follow the cable or the arch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms


@dataclass(frozen=True)
class Bridge:
    """A bridge and its vertex sets.

    mesh: four nodes a tetrahedron. held: vertices on the ground. middle: vertices whose sag is measured.
    """

    name: str
    mesh: ms.TetMesh
    held: np.ndarray
    middle: np.ndarray


SUSPENSION = (0.58, 0.16, 0.28)  # m, as [Qiao21]'s; 212 nodes, 668 tetrahedra, 65 nodes held there
ARCH = (0.74, 0.19, 0.36)  # m; 821 nodes, 2911 tetrahedra, 115 nodes held there


def suspension() -> Bridge:
    """Build a deck that hangs from two cables over two towers, held at its ends and at the towers' feet."""
    columns, towers, hangers = 19, (4, 14), (6, 8, 10, 12)
    i, j, k = _cells((columns, 3, 4))
    side = j != 1
    deck, cable = k == 1, side & (k == 3)
    tower = side & np.isin(i, towers)
    hanger = side & np.isin(i, hangers) & (k == 2)
    lattice = _lattice((columns, 3, 4), deck | cable | tower | hanger)
    u, v, w = lattice.rest_positions.T
    length, width, height = SUSPENSION
    x, y = length * u / columns, width * np.interp(v, [0, 1, 2, 3], [0, 0.2, 0.8, 1])
    along = np.interp(u, [0, towers[0] + 0.5, columns / 2, towers[1] + 0.5, columns], [1, 0, 1, 0, 1])
    hung = 0.93 - 0.42 * along**1.6  # of the height: the cable's lower side
    levels = np.array([np.zeros_like(u), 0.3 + 0 * u, 0.42 + 0 * u, hung, hung + 0.07])
    z = height * levels[np.round(w).astype(int), np.arange(len(u))]
    at_ends = (u < 0.5) | (u > columns - 0.5)
    held = np.flatnonzero(at_ends | (w < 0.5))
    middle = np.flatnonzero((np.abs(u - columns / 2) < 1) & (np.abs(w - 1.5) < 0.6))
    return Bridge("suspension", _with_positions(lattice, x, y, z), held, middle)


def arch() -> Bridge:
    """Build a road over two arches, held at the feet of three piers; its middle is that of both spans."""
    columns, rows, below = 24, 3, 7
    piers = [(0, 3), (10, 14), (21, 24)]
    i, _, k = _cells((columns, rows, below + 4))
    of_pier = np.any([(i >= first) & (i < last) for first, last in piers], axis=0)
    lattice = _lattice((columns, rows, below + 4), of_pier | (k >= below))
    u, v, w = lattice.rest_positions.T
    length, width, height = ARCH
    x, y = length * u / columns, width * v / rows
    spans = [(3, 10), (14, 21)]
    rise = sum(
        np.clip(1 - ((u - (a + b) / 2) / ((b - a) / 2)) ** 2, 0, None) ** 0.7 * ((u >= a) & (u <= b))
        for a, b in spans
    )
    springing = 0.55 + 0.27 * rise  # of the height: the lower side of the arches
    share = np.clip((w - below) / 4, 0, 1)
    z = height * np.where(w <= below, springing * w / below, springing + (1 - springing) * share)
    held = np.flatnonzero(w < 1.5)
    centers = np.array([(a + b) / 2 for a, b in spans])
    middle = np.flatnonzero((np.abs(u[:, None] - centers) < 1).any(axis=1) & (w > below + 2.5))
    return Bridge("arch", _with_positions(lattice, x, y, z), held, middle)


def _cells(counts) -> tuple[np.ndarray, ...]:
    """Return the indices of each cell along the axes."""
    return tuple(each.ravel() for each in np.meshgrid(*map(np.arange, counts), indexing="ij"))


def _lattice(counts, chosen: np.ndarray) -> ms.TetMesh:
    """Build a mesh of the chosen cells of size 1."""
    block = ms.meshes.box(counts, cells=counts)
    numbers = np.floor(block.rest_positions[block.tetrahedra].mean(axis=1)).astype(int)
    kept = chosen.reshape(counts)[tuple(numbers.T)]
    vertices, tetrahedra = np.unique(block.tetrahedra[kept], return_inverse=True)
    return ms.TetMesh(block.rest_positions[vertices], tetrahedra.reshape(-1, 4))


def _with_positions(lattice: ms.TetMesh, x, y, z) -> ms.TetMesh:
    return ms.TetMesh(np.stack([x, y, z], axis=1), lattice.tetrahedra)
