"""Integrals over six-node triangles, which may be curved, of what is given on them: by Gauss's rule, exact on flat ones."""

from __future__ import annotations

import numpy as np

_NODES = np.array(
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]
)  # parameters of six nodes
_WHOLE = _NODES[:3]


def rule(corners: np.ndarray, order: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 2) and weights (p,): Gauss's rule for the square, drawn together into a triangle (3, 2)."""
    at, lengths = np.polynomial.legendre.leggauss(order)
    u, v = (each.ravel() for each in np.meshgrid((at + 1) / 2, (at + 1) / 2))
    weights = np.outer(lengths, lengths).ravel() / 4 * (1 - u)
    first, second = corners[1:] - corners[0]
    area2 = first[0] * second[1] - first[1] * second[0]
    return corners[0] + u[:, None] * first + (v * (1 - u))[:, None] * second, weights * area2


def shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of six nodes at points (p, 2): (p, 6), and their slopes (p, 2, 6)."""
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
    """(p, n, 3), m2: along the normal at points (p, 2) of elements (n, 6, 3), as long as they stretch area there."""
    _, slopes = shapes(points)
    along = np.einsum("pan,kni->apki", slopes, positions)
    return np.cross(along[0], along[1])


def area_vectors(positions: np.ndarray) -> np.ndarray:
    """(n, 3), m2: the integrals of the unit normal over elements (n, 6, 3)."""
    points, weights = rule(_WHOLE)
    return np.einsum("p,pki->ki", weights, across(positions, points))


def shape_integrals(positions: np.ndarray, part: np.ndarray | None = None) -> np.ndarray:
    """(n, 6), m2: of the shape functions over elements (n, 6, 3), or over the flat face `part` (3,) of theirs alone, given
    by its nodes."""
    points, weights = rule(_WHOLE if part is None else _NODES[part])
    densities = np.linalg.norm(across(positions, points), axis=2)
    return np.einsum("p,pk,pn->kn", weights, densities, shapes(points)[0])


def shape_products(positions: np.ndarray) -> np.ndarray:
    """(n, 6, 6), m2: of the products of two of them."""
    points, weights = rule(_WHOLE)
    densities = np.linalg.norm(across(positions, points), axis=2)
    values = shapes(points)[0]
    return np.einsum("p,pk,pn,pm->knm", weights, densities, values, values)


def edge_integrals(positions: np.ndarray) -> np.ndarray:
    """(k, 3), m: of the shape functions along edges (k, 3, 3): their ends, then the node between."""
    at, lengths = np.polynomial.legendre.leggauss(5)
    s, weights = (at + 1) / 2, lengths / 2
    values = np.stack([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)], axis=1)
    slopes = np.stack([4 * s - 3, 4 * s - 1, 4 - 8 * s], axis=1)
    stretches = np.linalg.norm(np.einsum("pn,kni->pki", slopes, positions), axis=2)
    return np.einsum("p,pk,pn->kn", weights, stretches, values)


def edge_lengths(positions: np.ndarray) -> np.ndarray:
    """(k,), m, of edges (k, 3, 3)."""
    return edge_integrals(positions).sum(axis=1)
