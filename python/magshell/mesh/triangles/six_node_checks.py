"""Shape functions, integrals, checks and refinement of six-node triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..topology import FLAT

if TYPE_CHECKING:
    from .six_node_mesh import QuadraticTriangleMesh


# parameters (s, t) of the six nodes in the reference triangle
_NODES = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)])
_REFERENCE_TRIANGLE = _NODES[:3]


def rule(corners: np.ndarray, order: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (p, 2) and weights (p,) of a quadrature rule on a triangle with the given corners, (3, 2).

    It is the Gauss-Legendre product rule of the square, collapsed to a triangle; p = order^2.
    """
    at, lengths = np.polynomial.legendre.leggauss(order)
    u, v = (each.ravel() for each in np.meshgrid((at + 1) / 2, (at + 1) / 2))
    weights = np.outer(lengths, lengths).ravel() / 4 * (1 - u)
    first, second = corners[1:] - corners[0]
    area2 = first[0] * second[1] - first[1] * second[0]
    return corners[0] + u[:, None] * first + (v * (1 - u))[:, None] * second, weights * area2


def shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the six shape functions at points (p, 2), (p, 6), and their derivatives, (p, 2, 6)."""
    s, t = points.T
    corner = np.stack([1 - s - t, s, t], axis=1)
    slope = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    following = [1, 2, 0]
    values = [corner * (2 * corner - 1), 4 * corner * corner[:, following]]
    slopes = [
        slope * (4 * corner - 1)[:, None],
        4 * (corner[:, None] * slope[:, following] + corner[:, None, following] * slope),
    ]
    return np.concatenate(values, axis=1), np.concatenate(slopes, axis=2)


def across(positions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the normal vectors dx/ds x dx/dt at points (p, 2) of elements (n, 6, 3), (p, n, 3) m2.

    Their length is the ratio of an element's area to that of the reference triangle.
    """
    _, slopes = shapes(points)
    along = np.einsum("pan,kni->apki", slopes, positions)
    return np.cross(along[0], along[1])


def area_vectors(positions: np.ndarray) -> np.ndarray:
    """Return the integrals of the unit normal over elements (n, 6, 3), (n, 3) m2."""
    points, weights = rule(_REFERENCE_TRIANGLE)
    return np.einsum("p,pki->ki", weights, across(positions, points))


def shape_integrals(positions: np.ndarray, part: np.ndarray | None = None) -> np.ndarray:
    """Return the integrals of the shape functions over elements (n, 6, 3), (n, 6) m2.

    part: (3,), three nodes of an element; the integrals are then those over the part between these nodes.
    """
    points, weights = rule(_REFERENCE_TRIANGLE if part is None else _NODES[part])
    densities = np.linalg.norm(across(positions, points), axis=2)
    return np.einsum("p,pk,pn->kn", weights, densities, shapes(points)[0])


def by_shape_integrals(
    positions: np.ndarray, gradient: np.ndarray, part: np.ndarray | None = None
) -> np.ndarray:
    """Return the gradient with respect to the nodes of elements, (n, 6, 3), from that with respect to their
    `shape_integrals`, (n, 6).
    """
    points, weights = rule(_REFERENCE_TRIANGLE if part is None else _NODES[part])
    values, slopes = shapes(points)
    along = np.einsum("pan,kni->apki", slopes, positions)
    normal = np.cross(along[0], along[1])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    by_density = weights[:, None, None] * np.einsum("kn,pn->pk", gradient, values)[..., None]
    by_along = np.stack([np.cross(along[1], normal), np.cross(normal, along[0])])
    return np.einsum("apki,pan->kni", by_density * by_along, slopes)


def shape_products(positions: np.ndarray) -> np.ndarray:
    """Return the integrals of the products of two shape functions over elements (n, 6, 3), (n, 6, 6) m2."""
    points, weights = rule(_REFERENCE_TRIANGLE)
    densities = np.linalg.norm(across(positions, points), axis=2)
    values = shapes(points)[0]
    return np.einsum("p,pk,pn,pm->knm", weights, densities, values, values)


def edge_integrals(positions: np.ndarray) -> np.ndarray:
    """Return the integrals of the shape functions along edges, (k, 3) m.

    positions: (k, 3, 3) m, the two ends of each edge, then its midside node.
    """
    at, lengths = np.polynomial.legendre.leggauss(5)
    s, weights = (at + 1) / 2, lengths / 2
    values = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=1)
    slopes = np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], axis=1)
    stretches = np.linalg.norm(np.einsum("pn,kni->pki", slopes, positions), axis=2)
    return np.einsum("p,pk,pn->kn", weights, stretches, values)


def by_edge_integrals(positions: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the nodes of edges, (k, 3, 3), from that with respect to their
    `edge_integrals`, (k, 3).
    """
    at, lengths = np.polynomial.legendre.leggauss(5)
    s, weights = (at + 1) / 2, lengths / 2
    values = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=1)
    slopes = np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], axis=1)
    along = np.einsum("pn,kni->pki", slopes, positions)
    unit = along / np.linalg.norm(along, axis=2, keepdims=True)
    by_stretch = weights[:, None] * np.einsum("kn,pn->pk", gradient, values)
    return np.einsum("pk,pki,pn->kni", by_stretch, unit, slopes)


def edge_lengths(positions: np.ndarray) -> np.ndarray:
    """Return the lengths of curved edges, (k,) m; positions: as for `edge_integrals`."""
    return edge_integrals(positions).sum(axis=1)


_LATTICE = 6  # intervals along each edge of the points at which the Jacobian determinant must be positive
_LEAST = 1e-6  # [-] smallest Jacobian determinant of a valid element, relative to its mean


def check_elements(nodes: np.ndarray, n_vertices: int) -> None:
    """Raise ValueError unless the elements have shape (n, 6), valid and distinct vertices, and leave no vertex unused."""
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
    """Raise ValueError unless each edge has one midside node, which is neither on another edge nor a corner."""
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
    """Raise ValueError if the midside nodes of an element, (n, 6, 3) m, make its Jacobian determinant nonpositive."""
    mean = area_vectors(positions)
    steps = np.arange(_LATTICE + 1) / _LATTICE
    points = np.array([(s, t) for s in steps for t in steps if s + t < 1.0 + 1e-9])
    determinants = np.einsum("pni,ni->np", across(positions, points), mean) / 2.0
    worst = determinants.min(axis=1) / np.maximum((mean**2).sum(axis=1), 1e-300)
    bad = np.flatnonzero(~(worst > _LEAST))
    if len(bad):
        raise ValueError(
            f"element {bad[0]} is turned inside out by its nodes between the corners ({len(bad)} such elements): they must "
            "lie near the middles of their edges, in the order 01 12 20; on strongly curved surfaces elements must be "
            "smaller"
        )


_INNER = [(3, 4), (4, 5), (5, 3)]  # ends of the edges inside a divided element
_PARAMETERS = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)])


def inner_weights() -> np.ndarray:
    """Return the shape functions at the three nodes that `divided` puts inside an element, (3, 6)."""
    return weights_between(np.array(_INNER))


def weights_between(pairs: np.ndarray) -> np.ndarray:
    """Return the shape functions halfway between two nodes of an element each, (k, 6); pairs: (k, 2), 0 to 5."""
    return shapes(0.5 * (_PARAMETERS[pairs[:, 0]] + _PARAMETERS[pairs[:, 1]]))[0]


def divided(mesh: QuadraticTriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Divide each element into four with the same curved shape.

    Returns the positions of the new nodes, (2 n_e + 3 n, 3) m, and the elements (4 n, 6). The new nodes are two on each
    edge, first the one nearer to its first end, then three inside each element. Element k becomes 4 k to 4 k + 3: those at
    its corners, then the one between its midside nodes.
    """
    n_v, n_e, elements = mesh.n_vertices, mesh.n_edges, mesh.elements
    new = np.empty((2 * n_e + 3 * mesh.n_elements, 3))
    node_between: dict[tuple[int, int], np.ndarray] = {}

    def take(pair: tuple[int, int], rows: np.ndarray) -> None:
        at = 0.5 * (_PARAMETERS[pair[0]] + _PARAMETERS[pair[1]])
        new[rows] = np.einsum("n,kni->ki", shapes(at[None])[0][0], mesh.rest_positions[elements])
        node_between[pair] = node_between[pair[::-1]] = n_v + rows

    for middle, (first, second), opposite in ((3, (0, 1), 2), (4, (1, 2), 0), (5, (2, 0), 1)):
        edges = mesh.element_edges[:, opposite]
        for corner in (first, second):
            take((corner, middle), 2 * edges + (elements[:, corner] != mesh.edges[edges, 0]))
    for k, pair in enumerate(_INNER):
        take(pair, 2 * n_e + 3 * np.arange(mesh.n_elements) + k)

    children = []
    for a, b, c in FLAT:
        middles = [node_between[a, b], node_between[b, c], node_between[c, a]]
        children.append(np.stack([*elements[:, [a, b, c]].T, *middles], axis=1))
    return new, np.stack(children, axis=1).reshape(-1, 6)
