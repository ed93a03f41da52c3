"""Checks of tetrahedral meshes; each raises a ValueError that names the first invalid tetrahedra or vertices."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..topology import EDGES, FaceTable, edge_table, nonmanifold_edges, nonmanifold_vertices
from .jacobian import bent, jacobians, not_positive, straight_volumes

# [-] Smallest six-fold volume over the cube of the longest edge, which is 0.71 for a regular tetrahedron. Below this limit,
# round-off decides the sign of the volume.
DEGENERATE = 1e-10
_REPAIR_ADVICE = "TetMesh.repaired(...) repairs this, and reports what it did"
_GMSH_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


def listed(numbers: Iterable[Any], most: int = 5) -> str:
    """Format numbers for a message, the first `most` of them."""
    numbers = [tuple(n) if isinstance(n, list) else n for n in np.asarray(numbers).tolist()]
    return ", ".join(map(str, numbers[:most])) + (", ..." if len(numbers) > most else "")


def plural(count: int, one: str, several: str) -> str:
    return f"1 {one}" if count == 1 else f"{count} {several}"


def check_range(tetrahedra: np.ndarray, n_vertices: int) -> None:
    """Check the shape of the tetrahedra, (n_t, 4) or (n_t, 10), and that their vertices exist."""
    if tetrahedra.ndim != 2 or tetrahedra.shape[1] not in (4, 10):
        raise ValueError(f"tetrahedra must have shape (n_t, 4) or (n_t, 10), got {tetrahedra.shape}")
    if len(tetrahedra) == 0:
        raise ValueError("tetrahedra is empty; a mesh has at least one tetrahedron")
    if max(n_vertices, 4 * len(tetrahedra)) >= 2**31:
        raise ValueError(
            f"{n_vertices} vertices and {len(tetrahedra)} tetrahedra are more than 32-bit indices count"
        )
    outside = (tetrahedra < 0) | (tetrahedra >= n_vertices)
    if outside.any():
        t, i = np.argwhere(outside)[0]
        raise ValueError(
            f"tetrahedron {t} names vertex {tetrahedra[t, i]}, but vertices are numbered 0 to {n_vertices - 1}"
        )


def check_distinct(tetrahedra: np.ndarray) -> None:
    """Check that no tetrahedron has the same vertex twice."""
    twice = np.flatnonzero(names_twice(tetrahedra))
    if len(twice):
        t = twice[0]
        raise ValueError(
            f"tetrahedron {t} ({listed(tetrahedra[t], 10)}) names a vertex twice; its vertices must differ. {_REPAIR_ADVICE}"
        )


def names_twice(tetrahedra: np.ndarray) -> np.ndarray:
    """Return whether each tetrahedron has the same vertex twice, (n_t,) bool."""
    ordered = np.sort(tetrahedra, axis=1)
    return (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)


def check_all_used(tetrahedra: np.ndarray, n_vertices: int) -> None:
    """Check that every vertex belongs to a tetrahedron."""
    unused = np.flatnonzero(np.bincount(tetrahedra.ravel(), minlength=n_vertices) == 0)
    if len(unused):
        raise ValueError(
            f"{plural(len(unused), 'vertex belongs', 'vertices belong')} to no tetrahedron: {listed(unused)}. "
            f"{_REPAIR_ADVICE}"
        )


def volume_floor(corner_positions: np.ndarray) -> np.ndarray:
    """Return the volume below which a tetrahedron with its longest edge is degenerate, (n_t,) m3."""
    ends = corner_positions[:, EDGES]
    longest2 = np.square(ends[:, :, 1] - ends[:, :, 0]).sum(axis=2).max(axis=1)
    return DEGENERATE * longest2**1.5 / 6


def check_volumes(positions: np.ndarray, tetrahedra: np.ndarray) -> None:
    """Check that all tetrahedra have a positive volume, and are not degenerate."""
    corners = positions[tetrahedra[:, :4]]
    volumes, floor = straight_volumes(corners), volume_floor(corners)
    flat = np.flatnonzero(~(np.abs(volumes) > floor))
    if len(flat):
        t = flat[0]
        raise ValueError(
            f"{plural(len(flat), 'tetrahedron is', 'tetrahedra are')} degenerate: {listed(flat)}. Tetrahedron {t} "
            f"({listed(tetrahedra[t, :4])}) has a volume of {volumes[t]:.3g} m3; its corners coincide or lie in a plane"
        )
    negative = np.flatnonzero(volumes < 0)
    if len(negative):
        all_of_them = " (all)" if len(negative) == len(tetrahedra) else ""
        raise ValueError(
            f"{plural(len(negative), 'tetrahedron has', 'tetrahedra have')} negative volume{all_of_them}: "
            f"{listed(negative)}. Corners must be ordered so that (x1 - x0) x (x2 - x0) . (x3 - x0) > 0. {_REPAIR_ADVICE}"
        )


def check_duplicates(tetrahedra: np.ndarray) -> None:
    """Check that no two tetrahedra have the same corners."""
    repeats, of = duplicates(tetrahedra)
    if len(repeats):
        raise ValueError(
            f"tetrahedra {of[0]} and {repeats[0]} have the same corners ({listed(tetrahedra[of[0], :4])}), "
            f"{plural(len(repeats), 'such repeat', 'such repeats')}; every tetrahedron must be given once. {_REPAIR_ADVICE}"
        )


def duplicates(tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find the tetrahedra that have the same corners as an earlier one, ascending, (k,), and the earlier ones, (k,)."""
    ordered = np.sort(tetrahedra[:, :4], axis=1)
    _, first, which = np.unique(ordered, axis=0, return_index=True, return_inverse=True)
    earliest = first[which.ravel()]
    repeats = np.flatnonzero(earliest != np.arange(len(tetrahedra)))
    return repeats, earliest[repeats]


def check_faces(corners: np.ndarray, table: FaceTable) -> None:
    """Check that at most two tetrahedra meet at a face, one on each side."""
    crowded = np.flatnonzero(table.counts > 2)
    if len(crowded):
        sharing = np.sort(table.order[table.first[crowded[0]] :][: table.counts[crowded[0]]] // 4)
        face = np.intersect1d(np.intersect1d(corners[sharing[0]], corners[sharing[1]]), corners[sharing[2]])
        raise ValueError(
            f"face ({listed(face)}) belongs to {len(sharing)} tetrahedra ({listed(sharing)}); "
            f"at most 2 meet at a face ({plural(len(crowded), 'such face', 'such faces')})"
        )
    first = table.first[table.counts == 2]
    one, other = table.order[first], table.order[first + 1]
    overlapping = np.flatnonzero(table.even[one] == table.even[other])
    if len(overlapping):
        a, b = sorted((one[overlapping[0]] // 4, other[overlapping[0]] // 4))
        raise ValueError(
            f"tetrahedra {a} and {b} overlap: both lie on the same side of their common face "
            f"({listed(np.intersect1d(corners[a], corners[b]))})"
        )


def check_surface(faces: np.ndarray) -> None:
    """Check that a closed surface is a manifold: two faces at each edge, one fan of faces at each vertex.

    faces: (n_f, 3), corners.
    """
    edges = nonmanifold_edges(faces)
    if len(edges):
        raise ValueError(
            f"the surface touches itself at {plural(len(edges), 'edge', 'edges')}: {listed(edges)}. Join what meets "
            "there by tetrahedra that share a face, or give each side vertices of its own"
        )
    vertices = nonmanifold_vertices(faces)
    if len(vertices):
        raise ValueError(
            f"the surface touches itself at {plural(len(vertices), 'vertex', 'vertices')}: {listed(vertices)}. Join "
            "what meets there by tetrahedra that share a face, or give each side a vertex of its own"
        )


def check_middle_nodes(tetrahedra: np.ndarray) -> None:
    """Check that each edge has one midside node, the same in all tetrahedra around it, which is not a corner."""
    table = edge_table(tetrahedra[:, :4])
    which, nodes = table.tetrahedron_edges.ravel(), tetrahedra[:, 4:].ravel()
    node_of = np.zeros(len(table.edges), dtype=nodes.dtype)
    node_of[which] = nodes
    differing = np.flatnonzero(node_of[which] != nodes)
    if len(differing):
        edge = which[differing[0]]
        found = np.unique(nodes[which == edge])
        raise ValueError(
            f"edge ({listed(table.edges[edge])}) has the middle nodes {listed(found)} in different tetrahedra: it must "
            "have one. Nodes are corners 0 1 2 3, then those on edges 01 12 20 03 13 23; gmsh has the last two exchanged"
        )
    both = np.intersect1d(nodes, tetrahedra[:, :4])
    if len(both):
        raise ValueError(f"vertex {both[0]} is a corner of one tetrahedron and a middle node of another")
    values, counts = np.unique(node_of, return_counts=True)
    if (counts > 1).any():
        node = values[counts > 1][0]
        shared = table.edges[node_of == node]
        raise ValueError(f"vertex {node} is the middle node of several edges: {listed(shared)}")


def check_jacobians(positions: np.ndarray, tetrahedra: np.ndarray) -> None:
    """Check that the Jacobian determinant is positive everywhere in all ten-node tetrahedra."""
    curved = np.flatnonzero(bent(positions[tetrahedra]))
    nodes = positions[tetrahedra[curved]]
    floor = 6 * volume_floor(nodes[:, :4])
    bad = curved[not_positive(jacobians(nodes), floor)]
    if len(bad) == 0:
        return
    exchanged = not_positive(jacobians(nodes[:, _GMSH_ORDER]), floor)
    remedy = (
        "All are valid with the last two nodes exchanged: these are in gmsh's order"
        if not exchanged.any()
        else "Move their middle nodes towards the middle of their edges"
    )
    raise ValueError(
        f"{plural(len(bad), 'tetrahedron turns', 'tetrahedra turn')} inside out between the ten nodes "
        f"(the Jacobian is not positive): {listed(bad)}. {remedy}"
    )
