"""Edges, faces and the boundary surface of tetrahedral meshes, from their connectivity alone.

The nodes of a tetrahedron are numbered as in VTK: corners 0 to 3, with (x1 - x0) x (x2 - x0) . (x3 - x0) > 0, then, for ten
nodes, one on each of EDGES. Face i is opposite corner i, and its corners run counter-clockwise seen from outside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .connected import connected_groups

EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])
FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
# the ten nodes with corners 0 and 2 exchanged: this inverts the orientation, and `refined` still divides it in the same way
MIRRORED = np.array([2, 1, 0, 3, 5, 4, 6, 9, 8, 7])


def _node_between(a: int, b: int) -> int:
    return 4 + next(k for k, edge in enumerate(EDGES.tolist()) if set(edge) == {a, b})


# the six nodes of each face: corners a, b, c, then those between a and b, b and c, c and a
FACE_NODES = np.array(
    [[a, b, c, _node_between(a, b), _node_between(b, c), _node_between(c, a)] for a, b, c in FACES.tolist()]
)
FLAT = np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)])  # the four triangles on six nodes


class EdgeTable(NamedTuple):
    """The edges of a tetrahedral mesh.

    edges: (n_e, 2), lower vertex first, sorted. tetrahedron_edges: (n_t, 6), the edge at each of EDGES.
    """

    edges: np.ndarray
    tetrahedron_edges: np.ndarray


def edge_table(corners: np.ndarray) -> EdgeTable:
    """Build the table of the edges of tetrahedra with the given corners, (n_t, 4)."""
    ends = np.sort(corners[:, EDGES].astype(np.int64), axis=2)
    count = int(corners.max()) + 1
    keys, which = np.unique(ends[..., 0] * count + ends[..., 1], return_inverse=True)
    edges = np.stack([keys // count, keys % count], axis=1).astype(np.int32)
    return EdgeTable(edges, which.reshape(-1, 6).astype(np.int32))


class FaceTable(NamedTuple):
    """The faces of all tetrahedra, 4 t + i for face i of tetrahedron t, sorted so that equal faces follow each other.

    order: (4 n_t,), the sorted faces. first: (k,), the position in `order` at which each distinct face begins.
    even: (4 n_t,), True if the vertices of a face are an even permutation of their sorted numbers. A face between two
        tetrahedra on opposite sides is even in exactly one of them.
    """

    order: np.ndarray
    first: np.ndarray
    even: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        """The number of tetrahedra at each distinct face, (k,)."""
        return np.diff(np.append(self.first, len(self.order)))


def face_table(corners: np.ndarray) -> FaceTable:
    """Build the table of the faces of tetrahedra with the given corners, (n_t, 4)."""
    faces = corners[:, FACES].reshape(-1, 3).astype(np.int64)
    low, middle, high = np.sort(faces, axis=1).T
    pair = low * (int(corners.max()) + 1) + middle
    order = np.lexsort((high, pair))
    new = np.ones(len(order), dtype=bool)
    new[1:] = (pair[order[1:]] != pair[order[:-1]]) | (high[order[1:]] != high[order[:-1]])
    a, b, c = faces.T
    even = (a < b).astype(int) + (b < c) + (c < a) == 2
    return FaceTable(order, np.flatnonzero(new), even)


def neighbours(table: FaceTable) -> np.ndarray:
    """Return the pairs of tetrahedra that share a face, (k, 2)."""
    first = table.first[table.counts == 2]
    return np.stack([table.order[first], table.order[first + 1]], axis=1) // 4


def outer_faces(table: FaceTable) -> np.ndarray:
    """Return the faces that belong to one tetrahedron only, as 4 t + i, ascending."""
    return np.sort(table.order[table.first[table.counts == 1]])


def triangles_of(tetrahedra: np.ndarray, outer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the flat triangles (n_f, 3) on the given faces, and the tetrahedron of each, (n_f,).

    There is one triangle per face of three nodes, and four per face of six nodes. outer: (k,), faces as 4 t + i.
    """
    owner, side = np.divmod(outer, 4)
    if tetrahedra.shape[1] == 4:
        return tetrahedra[owner[:, None], FACES[side]], owner
    nodes = tetrahedra[owner[:, None], FACE_NODES[side]]
    return nodes[:, FLAT].reshape(-1, 3), np.repeat(owner, 4)


def nonmanifold_edges(faces: np.ndarray) -> np.ndarray:
    """Return the edges at which more than two triangles of a closed surface meet, (k, 2)."""
    ends = np.sort(faces[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    edges, counts = np.unique(ends, axis=0, return_counts=True)
    return edges[counts > 2]


def nonmanifold_vertices(faces: np.ndarray) -> np.ndarray:
    """Return the vertices at which more than one fan of triangles of a closed surface meets, (k,).

    Every edge of the surface must have two faces.
    """
    corner = np.arange(3 * len(faces)).reshape(-1, 3)
    start, end = faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()
    at_start, at_end = corner.ravel(), corner[:, [1, 2, 0]].ravel()
    low_first = start < end
    order = np.lexsort((low_first, np.maximum(start, end), np.minimum(start, end)))
    one, other = order[0::2], order[1::2]  # the two faces of an edge run it in opposite directions
    pairs = np.concatenate(
        [np.stack([at_start[one], at_end[other]], axis=1), np.stack([at_end[one], at_start[other]], axis=1)]
    )
    fans = connected_groups(corner.size, pairs)
    first = np.unique(fans, return_index=True)[1]
    vertex, counts = np.unique(faces.ravel()[first], return_counts=True)
    return vertex[counts > 1]
