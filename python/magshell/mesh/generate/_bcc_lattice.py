"""The body-centered cubic (BCC) lattice, whose tetrahedra are all congruent.

Its points are the corners and the centers of cubic cells. Each center, with its neighbour along an axis, forms four
tetrahedra with the four edges of the square between the two. Nodes 0 and 2 of a tetrahedron are centers, nodes 1 and 3 are
corners of cells. The edges 0-2 and 1-3 have the length of a cell: the *long* edges. The other four are the *short* edges,
sqrt(3)/2 times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..signed_distance import Distance


@dataclass(frozen=True)
class Lattice:
    """A body-centered cubic lattice with the signed distances of its points.

    points: (n, 3), m. values: (n,), m, the distances, none of them 0. parity: (n,), 0 or 1, different at the two ends of a
    long edge. colour: (n,), 0 to 3, different at the two ends of any edge. tetrahedra: (n_t, 4).
    """

    points: np.ndarray
    values: np.ndarray
    parity: np.ndarray
    colour: np.ndarray
    tetrahedra: np.ndarray


def lattice_inside(distance: Distance, low: np.ndarray, counts: np.ndarray, spacing: float) -> Lattice:
    """Build the lattice on a box of cells, with those of its tetrahedra that have a node inside the shape.

    distance: the signed distance of the shape. low: (3,), m, the lower corner of the box. counts: (3,), the numbers of
    cells. spacing: m, the length of a cell.
    """
    corner, center = _integers(counts + 1), _integers(counts)
    points = low + spacing * np.concatenate([corner, center + 0.5])
    values = distance(points)
    values[values == 0] = np.finfo(
        float
    ).tiny  # outside, but so near that the point snaps to its own position
    parity = np.concatenate([corner.sum(axis=1), center.sum(axis=1)]) % 2
    colour = parity + np.repeat([0, 2], [len(corner), len(center)])
    inside = values < 0
    tetrahedra = []
    for axis in range(3):
        pairs = center[center[:, axis] < counts[axis] - 1]
        step = np.eye(3, dtype=int)
        u, v = step[(axis + 1) % 3], step[(axis + 2) % 3]
        first = len(corner) + _number(pairs, counts)
        second = len(corner) + _number(pairs + step[axis], counts)
        square = [_number(pairs + step[axis] + offset, counts + 1) for offset in (0 * u, u, u + v, v)]
        for k in range(4):
            four = np.stack([first, square[k], second, square[(k + 1) % 4]], axis=1)
            tetrahedra.append(four[inside[four].any(axis=1)])
    return Lattice(points, values, parity, colour, np.concatenate(tetrahedra))


def _integers(counts: np.ndarray) -> np.ndarray:
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)


def _number(at: np.ndarray, counts: np.ndarray) -> np.ndarray:
    return (at[:, 0] * counts[1] + at[:, 1]) * counts[2] + at[:, 2]
