"""The body-centerd cubic lattice of tetrahedra, all alike.

Its points are the corners of cubic cells and their centers; each center and its neighbour along an axis make four
tetrahedra with the four edges of the square between them. Nodes 0 and 2 of a tetrahedron are the centers, 1 and 3 the
corners: both pairs are a cell apart, the *long* edges; the other four are the *short* ones, sqrt(3)/2 of that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..signed_distance import Distance


@dataclass(frozen=True)
class Lattice:
    """points: (n, 3), m. values: (n,), m, the distances there, none of them 0. parity: (n,), 0 or 1, different at
    the two ends of a long edge. colour: (n,), 0 to 3, different at the two ends of any edge. tetrahedra: (n_t, 4)."""

    points: np.ndarray
    values: np.ndarray
    parity: np.ndarray
    colour: np.ndarray
    tetrahedra: np.ndarray


def lattice_inside(distance: Distance, low: np.ndarray, counts: np.ndarray, spacing: float) -> Lattice:
    """The lattice on counts (3,) cells from `low` (3,) on, with those tetrahedra that reach inside."""
    corner, center = _integers(counts + 1), _integers(counts)
    points = low + spacing * np.concatenate([corner, center + 0.5])
    values = distance(points)
    values[values == 0] = np.finfo(float).tiny  # outside, and so near that the point moves to where it is
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
