"""Isosurface stuffing (Labelle and Shewchuk 2007, [Labelle07]) with tetrahedra of one size.

A body-centered cubic lattice of congruent tetrahedra covers the shape. Lattice points close to the surface snap onto it; the
tetrahedra that the surface still cuts are divided, and their inner parts are kept. The interior is the lattice itself. The
authors prove that all dihedral angles lie between 10.7 and 164.8 degrees.

[Labelle07] leaves open which diagonals are taken and in which order points move. Both are chosen here, and with them the
distance within which a point snaps, so the proof does not apply. The tests find the same bounds in lattices with random
signs and cuts (tests/mesh/test_stuffing.py).

The points of the body-centered cubic (BCC) lattice are the corners and the centers of cubic cells. Each center, with its
neighbour along an axis, forms four tetrahedra with the four edges of the square between the two. Nodes 0 and 2 of a
tetrahedron are centers, nodes 1 and 3 are corners of cells. The edges 0-2 and 1-3 are as long as a cell: the *long* edges.
The other four are the *short* edges, sqrt(3)/2 times as long.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..signed_distance import Distance, zeros_between
from ..topology import EDGES, FACES, edge_table

# [-] A lattice point snaps to a cut that is nearer than this fraction of the long or short edge. Larger values spoil
# tetrahedra whose corners move, smaller ones tetrahedra that are cut: with these, the smallest angle of both is 10.75
# degrees.
_NEAR_LONG, _NEAR_SHORT = 0.285, 0.398
_IS_LONG = np.array([sorted(edge) in ([0, 2], [1, 3]) for edge in EDGES.tolist()])


class Cuts:
    """The points at which the surface cuts the edges of a lattice."""

    def __init__(self, lattice: Lattice, distance: Distance):
        self.lattice = lattice
        table = edge_table(lattice.tetrahedra)
        self.tetrahedron_edges = table.tetrahedron_edges
        inside = lattice.values < 0
        outside = lattice.values > 0
        a, b = table.edges.astype(np.int64).T
        self.edges = np.flatnonzero((inside[a] & outside[b]) | (outside[a] & inside[b]))
        a, b = a[self.edges], b[self.edges]
        self.inner, self.outer = np.where(inside[a], a, b), np.where(inside[a], b, a)
        long = np.zeros(len(table.edges), dtype=bool)
        long[table.tetrahedron_edges[:, _IS_LONG]] = True
        self.near = np.where(long[self.edges], _NEAR_LONG, _NEAR_SHORT)
        self.length = np.where(long[self.edges], 1.0, np.sqrt(0.75))
        ends = lattice.points[self.inner], lattice.points[self.outer]
        at_ends = np.stack([lattice.values[self.inner], lattice.values[self.outer]], axis=1)
        self.fraction = zeros_between(distance, *ends, at_ends)
        self.points = ends[0] + self.fraction[:, None] * (ends[1] - ends[0])
        self.n_edges = len(table.edges)

    def prevent_snapping(self, vertices: np.ndarray) -> None:
        """Move the cuts on the edges of these vertices so far from both ends that neither end snaps to them."""
        affected = np.isin(self.inner, vertices) | np.isin(self.outer, vertices)
        least = self.near * (1 + 1e-9)  # above the threshold also after round-off
        self.fraction = np.where(affected, np.clip(self.fraction, least, 1 - least), self.fraction)
        ends = self.lattice.points[self.inner], self.lattice.points[self.outer]
        self.points = ends[0] + self.fraction[:, None] * (ends[1] - ends[0])


def stuffed(cuts: Cuts) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Build the tetrahedra inside the surface.

    Returns points (n, 3) m, of which the lattice points are the first; tetrahedra (n_t, 4) of either orientation; and for
    each lattice point -1 if it is inside, 1 if outside, 0 if it snapped onto the surface.
    """
    lattice = cuts.lattice
    points, sign = lattice.points.copy(), np.sign(lattice.values).astype(int)
    alive = _warp(cuts, points, sign)
    cut_of_edge = np.full(cuts.n_edges, -1)
    cut_of_edge[cuts.edges[alive]] = len(points) + np.arange(alive.sum())
    points = np.concatenate([points, cuts.points[alive]])
    return points, _pieces(cuts, sign, cut_of_edge, points), sign


def _warp(cuts: Cuts, points: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Move lattice points to their nearest cut if it is close enough, colour by colour.

    Points of one colour share no edge, so the result does not depend on their order. Changes `points` and `sign` in place.
    Returns which cuts remain, (n,) bool: those on no edge of a point that moved.
    """
    alive = np.ones(len(cuts.edges), dtype=bool)
    for colour in range(4):
        near_inner = alive & (cuts.fraction < cuts.near) & (cuts.lattice.colour[cuts.inner] == colour)
        near_outer = alive & (1 - cuts.fraction < cuts.near) & (cuts.lattice.colour[cuts.outer] == colour)
        edge = np.concatenate([np.flatnonzero(near_inner), np.flatnonzero(near_outer)])
        vertex = np.concatenate([cuts.inner[near_inner], cuts.outer[near_outer]])
        away = np.concatenate([cuts.fraction[near_inner], 1 - cuts.fraction[near_outer]]) * cuts.length[edge]
        order = np.lexsort((edge, away, vertex))
        moving, first = np.unique(vertex[order], return_index=True)
        points[moving] = cuts.points[edge[order[first]]]
        sign[moving] = 0
        alive &= (sign[cuts.inner] != 0) & (sign[cuts.outer] != 0)
    return alive


def _pieces(cuts: Cuts, sign: np.ndarray, cut_of_edge: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the tetrahedra (n_t, 4) that fill the part of each lattice tetrahedron inside the surface."""
    tetrahedra, parity = cuts.lattice.tetrahedra, cuts.lattice.parity
    signs = sign[tetrahedra]
    n_in, n_out = (signs < 0).sum(axis=1), (signs > 0).sum(axis=1)
    uncut = tetrahedra[(n_in > 0) & (n_out == 0)]

    split = np.flatnonzero((n_in > 0) & (n_out > 0))
    four, signs, n_in, n_out = tetrahedra[split], signs[split], n_in[split], n_out[split]
    between = np.full((len(split), 4, 4), -1)
    for k, (a, b) in enumerate(EDGES):
        between[:, a, b] = between[:, b, a] = cut_of_edge[cuts.tetrahedron_edges[split, k]]

    one = n_in == 1
    inner = np.argmin(signs, axis=1)
    to_inner = np.take_along_axis(between, inner[:, None, None], axis=1)[:, 0]
    pieces = [uncut, np.where(signs > 0, to_inner, four)[one]]
    for number, cut_up in ((2, _two_inside), (3, _three_inside)):
        chosen = n_in == number
        pieces += cut_up(four[chosen], signs[chosen], between[chosen], parity, points)
    return np.concatenate(pieces)


def _three_inside(four, signs, between, parity, points) -> list[np.ndarray]:
    """Divide tetrahedra with three inner corners: the part inside is a prism of these corners and three cuts."""
    out = np.argmax(signs, axis=1)
    partner = (out + 2) % 4
    p, q = (out + 1) % 4, (out + 3) % 4
    row = np.arange(len(four))
    even_first = parity[four[row, p]] == 0
    p, q = np.where(even_first, p, q), np.where(even_first, q, p)
    a, b, c = four[row, partner], four[row, p], four[row, q]
    a_cut, b_cut, c_cut = between[row, partner, out], between[row, p, out], between[row, q, out]
    # diagonals of the sides a b and a c: from the cut of the long edge; of the side b c: from the corner of even parity
    return _stack((a, b, c, a_cut), (a_cut, b, c, c_cut), (a_cut, b, c_cut, b_cut))


def _two_inside(four, signs, between, parity, points) -> list[np.ndarray]:
    """Divide tetrahedra with two inner corners: a pyramid if a third is on the surface, otherwise a wedge."""
    row = np.arange(len(four))
    order = np.argsort(signs, axis=1, kind="stable")
    p, q, r, s = order.T
    # corner r is on the surface: a pyramid with its apex there
    zero = signs[row, r] == 0
    pyramid = _pyramid(*(x[zero] for x in (four, between, p, q, r, s)), parity)
    four, between, row = four[~zero], between[~zero], np.arange((~zero).sum())
    p, q, r, s = p[~zero], q[~zero], r[~zero], s[~zero]
    opposite = (p + 2) % 4 == q
    return (
        pyramid
        + _long_ridge(*(x[opposite] for x in (four, between, p, q, r, s)), parity, points)
        + _short_ridge(*(x[~opposite] for x in (four, between, p, q)))
    )


def _pyramid(four, between, p, q, apex, out, parity) -> list[np.ndarray]:
    """Divide pyramids on the inner corners p and q, their two cuts, and an apex on the surface."""
    row = np.arange(len(four))
    along = (p + 2) % 4 == q
    q_to_out = (q + 2) % 4 == out
    first = np.where(along, parity[four[row, p]] == 0, q_to_out)
    p, q = np.where(first, p, q), np.where(first, q, p)
    a, b, top = four[row, p], four[row, q], four[row, apex]
    a_cut, b_cut = between[row, p, out], between[row, q, out]
    # the diagonal of the base runs from a to b_cut, where the edge of b is the long one, or a has even parity
    return _stack((a, b, b_cut, top), (a, b_cut, a_cut, top))


def _long_ridge(four, between, p, q, r, s, parity, points) -> list[np.ndarray]:
    """Divide tetrahedra whose two inner corners are the ends of a long edge."""
    row = np.arange(len(four))
    even_first = parity[four[row, p]] == 0
    p, q = np.where(even_first, p, q), np.where(even_first, q, p)
    even_first = parity[four[row, r]] == 0
    r, s = np.where(even_first, r, s), np.where(even_first, s, r)
    a, b = four[row, p], four[row, q]
    ar, as_, br, bs = between[row, p, r], between[row, p, s], between[row, q, r], between[row, q, s]
    # the diagonals of the sides go from a to br and bs; of the two diagonals of the cut, that with the larger smallest angle
    one = [(a, ar, as_, bs), (a, br, bs, ar)]
    other = [(a, ar, as_, br), (a, br, bs, as_)]
    least = [
        np.min([_least_angles(points[np.stack(t, axis=1)]) for t in two], axis=0) for two in (one, other)
    ]
    better = least[0] >= least[1]
    chosen = [
        tuple(np.where(better, x, y) for x, y in zip(*both, strict=True))
        for both in zip(one, other, strict=True)
    ]
    return _stack((a, b, br, bs), *chosen)


def _short_ridge(four, between, p, q) -> list[np.ndarray]:
    """Divide tetrahedra whose two inner corners are the ends of a short edge.

    Each corner has one cut on its long edge, and one on a short edge.
    """
    row = np.arange(len(four))
    r, s = (p + 2) % 4, (q + 2) % 4
    a, b = four[row, p], four[row, q]
    ar, as_, br, bs = between[row, p, r], between[row, p, s], between[row, q, r], between[row, q, s]
    # diagonals: of the side a b r from ar to b, of the side a b s from bs to a, of the cut from ar to bs
    return _stack((a, b, ar, bs), (a, ar, as_, bs), (b, bs, br, ar))


def _stack(*corners) -> list[np.ndarray]:
    return [np.stack(each, axis=1) for each in corners]


def _least_angles(corners: np.ndarray) -> np.ndarray:
    """Return a measure of the smallest dihedral angle of tetrahedra (n_t, 4, 3): minus the largest cosine, (n_t,).

    It is rounded, so that round-off does not decide between equal angles.
    """
    x, y, z = np.moveaxis(corners[:, FACES], 2, 0)
    normals = np.cross(y - x, z - x)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    one, other = np.triu_indices(4, 1)
    cosines = -np.einsum("tei,tei->te", normals[:, one], normals[:, other])
    return -np.round(cosines.max(axis=1), 9)


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
