"""Isosurface stuffing (Labelle and Shewchuk 2007), with tetrahedra of one size.

A body-centerd cubic lattice of tetrahedra, all alike, covers the shape. Lattice points that the surface passes nearby
move onto it; the tetrahedra that the surface still cuts are cut there. Nothing comes out with dihedral angles beyond
those of its authors' proof, 10.7 and 164.8 degrees, and what lies inside is the lattice.

In comments, [Labelle07]. What it leaves open (which diagonals, in which order points move) is chosen here, and with it
how near is nearby: the bounds hold in lattices of random signs and cuts (tests/mesh/test_stuffing.py), which is no proof.
"""

from __future__ import annotations

import numpy as np

from ..signed_distance import Distance, zeros_between
from ..topology import EDGES, FACES, edge_table
from ._bcc_lattice import Lattice

# how near to a point, as a fraction of the edge, a cut moves it. Larger ones spoil tetrahedra whose corners move, smaller
# ones those that are cut: here both reach 10.75 degrees
_NEAR_LONG, _NEAR_SHORT = 0.285, 0.398
_IS_LONG = np.array([sorted(edge) in ([0, 2], [1, 3]) for edge in EDGES.tolist()])


class Cuts:
    """Where the surface cuts the edges of a lattice."""

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

    def keep_away(self, vertices: np.ndarray) -> None:
        """Cuts next to these vertices move so far from them, and from their neighbours, that neither will move."""
        held = np.isin(self.inner, vertices) | np.isin(self.outer, vertices)
        least = self.near * (1 + 1e-9)  # round-off must not move it after all
        self.fraction = np.where(held, np.clip(self.fraction, least, 1 - least), self.fraction)
        ends = self.lattice.points[self.inner], self.lattice.points[self.outer]
        self.points = ends[0] + self.fraction[:, None] * (ends[1] - ends[0])


def stuffed(cuts: Cuts) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), the lattice's first; tetrahedra (n_t, 4), either way around; and for each lattice point -1 where it is
    inside, 1 outside, 0 where it moved onto the surface."""
    lattice = cuts.lattice
    points, sign = lattice.points.copy(), np.sign(lattice.values).astype(int)
    alive = _warp(cuts, points, sign)
    cut_of_edge = np.full(cuts.n_edges, -1)
    cut_of_edge[cuts.edges[alive]] = len(points) + np.arange(alive.sum())
    points = np.concatenate([points, cuts.points[alive]])
    return points, _pieces(cuts, sign, cut_of_edge, points), sign


def _warp(cuts: Cuts, points: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Moves lattice points onto cuts that are near, in turns of points that have no edge in common. Returns which cuts are
    left, (n,) bool: those on no edge of a point that moved."""
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
    """What of each tetrahedron lies inside, (n_t, 4)."""
    tetrahedra, parity = cuts.lattice.tetrahedra, cuts.lattice.parity
    signs = sign[tetrahedra]
    n_in, n_out = (signs < 0).sum(axis=1), (signs > 0).sum(axis=1)
    whole = tetrahedra[(n_in > 0) & (n_out == 0)]

    split = np.flatnonzero((n_in > 0) & (n_out > 0))
    four, signs, n_in, n_out = tetrahedra[split], signs[split], n_in[split], n_out[split]
    between = np.full((len(split), 4, 4), -1)
    for k, (a, b) in enumerate(EDGES):
        between[:, a, b] = between[:, b, a] = cut_of_edge[cuts.tetrahedron_edges[split, k]]

    one = n_in == 1
    inner = np.argmin(signs, axis=1)
    to_inner = np.take_along_axis(between, inner[:, None, None], axis=1)[:, 0]
    pieces = [whole, np.where(signs > 0, to_inner, four)[one]]
    for number, cut_up in ((2, _two_inside), (3, _three_inside)):
        chosen = n_in == number
        pieces += cut_up(four[chosen], signs[chosen], between[chosen], parity, points)
    return np.concatenate(pieces)


def _three_inside(four, signs, between, parity, points) -> list[np.ndarray]:
    """A prism: three corners, and their cuts with the edges to the fourth."""
    out = np.argmax(signs, axis=1)
    partner = (out + 2) % 4
    p, q = (out + 1) % 4, (out + 3) % 4
    row = np.arange(len(four))
    even_first = parity[four[row, p]] == 0
    p, q = np.where(even_first, p, q), np.where(even_first, q, p)
    a, b, c = four[row, partner], four[row, p], four[row, q]
    a_cut, b_cut, c_cut = between[row, partner, out], between[row, p, out], between[row, q, out]
    # sides a b and a c: from the cut of the long edge; side b c: from the even corner
    return _stack((a, b, c, a_cut), (a_cut, b, c, c_cut), (a_cut, b, c_cut, b_cut))


def _two_inside(four, signs, between, parity, points) -> list[np.ndarray]:
    row = np.arange(len(four))
    order = np.argsort(signs, axis=1, kind="stable")
    p, q, r, s = order.T
    # with a corner on the surface, r: a pyramid with the apex there
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
    row = np.arange(len(four))
    along = (p + 2) % 4 == q
    q_to_out = (q + 2) % 4 == out
    first = np.where(along, parity[four[row, p]] == 0, q_to_out)
    p, q = np.where(first, p, q), np.where(first, q, p)
    a, b, top = four[row, p], four[row, q], four[row, apex]
    a_cut, b_cut = between[row, p, out], between[row, q, out]
    # the diagonal from a to b_cut: b's edge is the long one, or a is even
    return _stack((a, b, b_cut, top), (a, b_cut, a_cut, top))


def _long_ridge(four, between, p, q, r, s, parity, points) -> list[np.ndarray]:
    """Both inner corners on one long edge: its sides are cut alike."""
    row = np.arange(len(four))
    even_first = parity[four[row, p]] == 0
    p, q = np.where(even_first, p, q), np.where(even_first, q, p)
    even_first = parity[four[row, r]] == 0
    r, s = np.where(even_first, r, s), np.where(even_first, s, r)
    a, b = four[row, p], four[row, q]
    ar, as_, br, bs = between[row, p, r], between[row, p, s], between[row, q, r], between[row, q, s]
    # the diagonals of the sides go from a to br and bs; the cut itself is divided so that the smallest angle is larger
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
    """Both inner corners on a short edge: each is cut on its own long edge and on a short one to the other's partner."""
    row = np.arange(len(four))
    r, s = (p + 2) % 4, (q + 2) % 4
    a, b = four[row, p], four[row, q]
    ar, as_, br, bs = between[row, p, r], between[row, p, s], between[row, q, r], between[row, q, s]
    # sides a b r: from ar to b; a b s: from bs to a; the cut: from ar to bs
    return _stack((a, b, ar, bs), (a, ar, as_, bs), (b, bs, br, ar))


def _stack(*corners) -> list[np.ndarray]:
    return [np.stack(each, axis=1) for each in corners]


def _least_angles(corners: np.ndarray) -> np.ndarray:
    """(n_t,): minus the largest cosine of the dihedral angles of tetrahedra (n_t, 4, 3), rounded so that round-off does
    not decide between equal ones."""
    x, y, z = np.moveaxis(corners[:, FACES], 2, 0)
    normals = np.cross(y - x, z - x)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    one, other = np.triu_indices(4, 1)
    cosines = -np.einsum("tei,tei->te", normals[:, one], normals[:, other])
    return -np.round(cosines.max(axis=1), 9)
