"""Local refinement of tetrahedra by halving edges, longer ones first (Plaza and Carey 2000)."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..groups import row_numbers
from ..topology import FACE_NODES

if TYPE_CHECKING:
    from .tet_mesh import TetMesh

_ALIKE = 1e-9  # [-] relative difference of lengths that is round-off
_EDGES_OF_FACES = FACE_NODES[:, 3:] - 4  # (4, 3), among the six edges of a tetrahedron


def bisected_edges(mesh: TetMesh, marked: np.ndarray) -> np.ndarray:
    """Return the edges to be divided so that the marked tetrahedra, (k,), are divided and the mesh stays conforming.

    They are all edges of marked tetrahedra, and the longest edge of every tetrahedron and face that has another divided
    edge. The shorter ones come first; of equally long ones those with smaller numbers.
    """
    order = _by_length(mesh)
    ranks = np.empty(mesh.n_edges, dtype=np.int64)
    ranks[order] = np.arange(mesh.n_edges)
    of_elements = ranks[mesh.tetrahedron_edges]
    of_faces = of_elements[:, _EDGES_OF_FACES].reshape(-1, 3)
    divided = np.zeros(mesh.n_edges, dtype=bool)  # by rank
    divided[of_elements[marked]] = True
    while True:
        before = divided.sum()
        for edges in (of_faces, of_elements):
            divided[edges[divided[edges].any(axis=1)].max(axis=1)] = True
        if divided.sum() == before:
            return order[divided]


def _by_length(mesh: TetMesh) -> np.ndarray:
    """Return all edges, shorter ones first; lengths that differ by round-off only are equal."""
    lengths = mesh.edge_lengths
    order = np.argsort(lengths, kind="stable")
    longer = np.diff(lengths[order], prepend=0.0) > _ALIKE * lengths[order]
    classes = np.empty(mesh.n_edges, dtype=np.int64)
    classes[order] = np.cumsum(longer)
    return np.lexsort((np.arange(mesh.n_edges), classes))


def divided_simplices(
    simplices: np.ndarray, ends: np.ndarray, middles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts (m, c) of edges, faces or tetrahedra (n, c) with some edges divided, and where each lies in, (m,).

    ends, middles: (k, 2) and (k,), the ends and the middle vertices of the divided edges. Each simplex is bisected across
    the last of them that it has, and so are its parts. Thus a face is divided in the same way from both of its sides. Parts
    keep the orientation, and those of a simplex follow each other.
    """
    pairs = np.array(list(combinations(range(simplices.shape[1]), 2)))
    parts, parents = simplices.astype(np.int64), np.arange(len(simplices))
    found = []
    while not found or len(parts):
        edges = row_numbers(ends, parts[:, pairs].reshape(-1, 2)).reshape(-1, len(pairs))
        last, at = edges.max(axis=1), edges.argmax(axis=1)
        whole = last < 0
        found.append((parts[whole], parents[whole]))
        parts, parents, middle = parts[~whole], parents[~whole], middles[last[~whole]]
        halves = np.repeat(parts[:, None], 2, axis=1)
        rows = np.arange(len(parts))
        for half, corner in enumerate(pairs[at[~whole]].T):
            halves[rows, half, corner] = middle
        parts, parents = halves.reshape(-1, simplices.shape[1]), np.repeat(parents, 2)
    parts, parents = (np.concatenate(each) for each in zip(*found, strict=True))
    order = np.argsort(parents, kind="stable")
    return parts[order], parents[order]
