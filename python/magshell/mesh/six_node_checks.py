"""What a mesh of six-node triangles must hold; each refusal names the first offender."""

from __future__ import annotations

import numpy as np

from .six_node_integrals import across, area_vectors

_LATTICE = 6  # points along each edge at which the element must not be inside out
_LEAST = 1e-6  # of the mean: below it an element is folded up


def check_elements(nodes: np.ndarray, n_vertices: int) -> None:
    """Raises ValueError where shape or numbers are wrong."""
    if nodes.ndim != 2 or nodes.shape[1] != 6:
        raise ValueError(f"elements must have shape (n, 6), got {nodes.shape}")
    if len(nodes) == 0:
        raise ValueError("elements is empty; a mesh has at least one element")
    outside = (nodes < 0) | (nodes >= n_vertices)
    if outside.any():
        k, i = np.argwhere(outside)[0]
        raise ValueError(
            f"element {k} names vertex {nodes[k, i]}, but vertices are numbered 0 to {n_vertices - 1}"
        )
    unused = np.flatnonzero(np.bincount(nodes.ravel(), minlength=n_vertices) == 0)
    if len(unused):
        raise ValueError(f"vertex {unused[0]} belongs to no element ({len(unused)} such vertices)")
    ordered = np.sort(nodes, axis=1)
    twice = np.flatnonzero((ordered[:, 1:] == ordered[:, :-1]).any(axis=1))
    if len(twice):
        raise ValueError(f"element {twice[0]} ({nodes[twice[0]].tolist()}) names a vertex twice")


def check_middle_nodes(nodes: np.ndarray, element_edges: np.ndarray) -> None:
    """Raises ValueError unless each edge has one node, which is on no other and no corner."""
    edges, middles = element_edges[:, [2, 0, 1]].ravel(), nodes[:, 3:].ravel()
    corner = np.isin(middles, nodes[:, :3])
    if corner.any():
        at = int(np.argmax(corner))
        raise ValueError(f"element {at // 3}: vertex {middles[at]} is a corner and a node between corners")
    of_edge = np.full(edges.max() + 1, -1)
    of_edge[edges] = middles
    apart = of_edge[edges] != middles
    if apart.any():
        at = int(np.argmax(apart))
        raise ValueError(
            f"element {at // 3} has vertex {middles[at]} on an edge where its neighbour has {of_edge[edges[at]]}: "
            "neighbours share the node between them"
        )
    counts = np.bincount(of_edge, minlength=1)
    if (counts > 1).any():
        raise ValueError(f"vertex {int(np.argmax(counts > 1))} is on two edges")


def check_jacobians(positions: np.ndarray) -> None:
    """Raises ValueError where an element (n, 6, 3) is turned inside out or folded up by its nodes between the corners."""
    mean = area_vectors(positions)
    steps = np.arange(_LATTICE + 1) / _LATTICE
    points = np.array([(s, t) for s in steps for t in steps if s + t < 1.0 + 1e-9])
    shares = np.einsum("pni,ni->np", across(positions, points), mean) / 2.0
    worst = shares.min(axis=1) / np.maximum((mean**2).sum(axis=1), 1e-300)
    bad = np.flatnonzero(~(worst > _LEAST))
    if len(bad):
        raise ValueError(
            f"element {bad[0]} is turned inside out by its nodes between the corners ({len(bad)} such elements): they must "
            "lie near the middles of their edges, in the order 01 12 20; on strongly curved surfaces elements must be "
            "smaller"
        )
