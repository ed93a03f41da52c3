"""Jacobian determinants of tetrahedra, and integrals over them.

The Jacobian determinant of a ten-node tetrahedron is a cubic polynomial in its barycentric coordinates. It is represented by
its 20 coefficients in the Bernstein basis, which bound it: the polynomial is positive if all coefficients are.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from math import factorial

import numpy as np

from ..topology import EDGES

# powers (20, 4) of the barycentric coordinates in the Bernstein polynomials of third degree
POWERS = np.array([powers for powers in product(range(4), repeat=4) if sum(powers) == 3])
_POINTS = POWERS / 3.0
_LEVELS = 4  # subdivisions to decide whether a polynomial with coefficients of both signs is positive


def _basis(points: np.ndarray) -> np.ndarray:
    """Return the cubic Bernstein polynomials at barycentric coordinates (n, 4), (n, 20)."""
    weights = [6 / np.prod([factorial(p) for p in powers]) for powers in POWERS.tolist()]
    return np.prod(points[:, None, :] ** POWERS, axis=2) * weights


_FROM_VALUES = np.linalg.inv(_basis(_POINTS))


def shape_gradients(points: np.ndarray) -> np.ndarray:
    """Return the derivatives of the ten shape functions at barycentric coordinates (n, 4), (n, 10, 3).

    They are with respect to the last three coordinates; the first is one minus their sum.
    """
    corner = np.zeros((len(points), 10, 4))
    for i in range(4):
        corner[:, i, i] = 4 * points[:, i] - 1
    for k, (i, j) in enumerate(EDGES):
        corner[:, 4 + k, i] = 4 * points[:, j]
        corner[:, 4 + k, j] = 4 * points[:, i]
    return corner[:, :, 1:] - corner[:, :, :1]


def _halves() -> np.ndarray:
    """Return the matrices (8, 20, 20) that map Bernstein coefficients on a tetrahedron to those on its eight parts."""
    corners = np.eye(4)
    middle = {(i, j): 0.5 * (corners[i] + corners[j]) for i in range(4) for j in range(4)}
    parts = [[middle[i, j] for j in range(4)] for i in range(4)]
    ring = [middle[0, 1], middle[1, 2], middle[2, 3], middle[0, 3]]
    parts += [[middle[0, 2], middle[1, 3], ring[k], ring[(k + 1) % 4]] for k in range(4)]
    return np.array([_FROM_VALUES @ _basis(_POINTS @ np.array(part)) for part in parts])


_PARTS = _halves()
_AT_POINTS = shape_gradients(_POINTS)


def straight_volumes(corner_positions: np.ndarray) -> np.ndarray:
    """Return the signed volumes of tetrahedra with straight edges and corners (n_t, 4, 3) m, (n_t,) m3."""
    a, b, c = np.moveaxis(corner_positions[:, 1:] - corner_positions[:, :1], 1, 0)
    return np.einsum("ti,ti->t", np.cross(a, b), c) / 6


def jacobians(node_positions: np.ndarray) -> np.ndarray:
    """Return the Bernstein coefficients of the Jacobian determinant of ten-node tetrahedra (n_t, 10, 3), (n_t, 20) m3."""
    values = np.linalg.det(np.einsum("pna,tni->tpia", _AT_POINTS, node_positions))
    return values @ _FROM_VALUES.T


def bent(node_positions: np.ndarray) -> np.ndarray:
    """Return whether each ten-node tetrahedron (n_t, 10, 3) has a midside node off the middle of its edge, (n_t,) bool.

    Round-off is tolerated. The Jacobian determinant of the others is constant, and follows from their corners.
    """
    ends = node_positions[:, EDGES]
    off = node_positions[:, 4:] - ends.mean(axis=2)
    lengths2 = np.square(ends[:, :, 1] - ends[:, :, 0]).sum(axis=2)
    return (np.square(off).sum(axis=2) > 1e-28 * lengths2).any(axis=1)


def quadratic_volumes(node_positions: np.ndarray) -> np.ndarray:
    """Return the signed volumes of ten-node tetrahedra (n_t, 10, 3), (n_t,) m3."""
    volumes = straight_volumes(node_positions[:, :4])
    curved = bent(node_positions)
    volumes[curved] = jacobians(node_positions[curved]).mean(axis=1) / 6
    return volumes


def least_jacobians(coefficients: np.ndarray) -> np.ndarray:
    """Return the smallest value of each cubic polynomial at its 20 interpolation points, (n_t,) m3.

    coefficients: (n_t, 20) m3, in the Bernstein basis.
    """
    return (coefficients @ _basis(_POINTS).T).min(axis=1)


def not_positive(coefficients: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """Return whether each polynomial reaches its floor (n_t,) or falls below it somewhere, (n_t,) bool.

    A polynomial is above its floor if all of its Bernstein coefficients are. Otherwise its values at the interpolation
    points are checked, and the tetrahedron is divided into eight. A polynomial still undecided after _LEVELS subdivisions is
    reported as not positive.
    """
    bad = np.zeros(len(coefficients), dtype=bool)
    open_ones, owner = coefficients, np.arange(len(coefficients))
    for level in range(_LEVELS + 1):
        undecided = open_ones.min(axis=1) <= floor[owner]
        open_ones, owner = open_ones[undecided], owner[undecided]
        if len(owner) == 0:
            return bad
        bad[owner[least_jacobians(open_ones) <= floor[owner]]] = True
        undecided = ~bad[owner]
        open_ones, owner = open_ones[undecided], owner[undecided]
        if level < _LEVELS:
            open_ones = np.einsum("pij,tj->tpi", _PARTS, open_ones).reshape(-1, 20)
            owner = np.repeat(owner, 8)
    bad[owner] = True
    return bad


def shape_values(points: np.ndarray) -> np.ndarray:
    """Return the ten shape functions at barycentric coordinates (n, 4), (n, 10)."""
    at_corners = points * (2 * points - 1)
    return np.concatenate([at_corners, 4 * points[:, EDGES[:, 0]] * points[:, EDGES[:, 1]]], axis=1)


Polynomial = dict[tuple[int, ...], float]  # {powers of the four coordinates: factor}


def _shapes() -> list[Polynomial]:
    """Return the ten shape functions as homogeneous quadratic polynomials of the four barycentric coordinates.

    Linear terms are multiplied by the sum of the coordinates, which is one.
    """
    one = np.eye(4, dtype=int)
    corners = [{tuple(one[i] + one[j]): 1.0 if i == j else -1.0 for j in range(4)} for i in range(4)]
    return corners + [{tuple(one[i] + one[j]): 4.0} for i, j in EDGES]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    """Multiply two polynomials."""
    product: Polynomial = {}
    for p, x in a.items():
        for q, y in b.items():
            powers = tuple(np.add(p, q).tolist())
            product[powers] = product.get(powers, 0.0) + x * y
    return product


def _with_jacobian(polynomial: Polynomial) -> np.ndarray:
    """Return the integrals of a polynomial times each Bernstein polynomial over the reference tetrahedron, (20,)."""
    integrals = np.zeros(len(POWERS))
    for j, others in enumerate(POWERS):
        scale = 6 / np.prod([factorial(p) for p in others])
        for powers, factor in polynomial.items():
            total = others + powers
            integrals[j] += (
                factor * scale * np.prod([factorial(p) for p in total]) / factorial(int(total.sum()) + 3)
            )
    return integrals


@cache
def _integrals() -> np.ndarray:
    """Return the integrals of shape functions times Bernstein polynomials, (10, 20)."""
    return np.array([_with_jacobian(shape) for shape in _shapes()])


@cache
def _products() -> np.ndarray:
    """Return the integrals of products of two shape functions times Bernstein polynomials, (10, 10, 20)."""
    return np.array([[_with_jacobian(_product(a, b)) for b in _shapes()] for a in _shapes()])


def _coefficients(node_positions: np.ndarray) -> np.ndarray:
    """Return the Bernstein coefficients of the Jacobian determinant, (n_t, 20) m3; equal for a straight tetrahedron."""
    coefficients = np.repeat(6.0 * straight_volumes(node_positions[:, :4])[:, None], len(POWERS), axis=1)
    curved = bent(node_positions)
    coefficients[curved] = jacobians(node_positions[curved])
    return coefficients


def shape_integrals(node_positions: np.ndarray) -> np.ndarray:
    """Return the integrals of the ten shape functions over ten-node tetrahedra (n_t, 10, 3), (n_t, 10) m3.

    For straight tetrahedra they are -1/20 of the volume at corners and 1/5 at midside nodes.
    """
    return _coefficients(node_positions) @ _integrals().T


def by_shape_integrals(node_positions: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the gradient with respect to the nodes of ten-node tetrahedra, (n_t, 10, 3), from that with respect to
    `shape_integrals`, (n_t, 10).

    A Jacobian determinant x_1 . (x_2 x x_3) with the columns x_a = dX/dxi_a changes by x_2 x x_3 . dx_1 and so on.
    """
    points, _, axes = _AT_POINTS.shape
    slopes = np.ascontiguousarray(np.swapaxes(_AT_POINTS, 1, 2)).reshape(
        points * axes, -1
    )  # of the shape functions
    columns = (slopes @ node_positions).reshape(-1, points, axes, 3)
    by_columns = np.cross(np.roll(columns, -1, axis=2), np.roll(columns, -2, axis=2))
    by_columns *= (gradient @ (_integrals() @ _FROM_VALUES))[..., None, None]
    return slopes.T @ by_columns.reshape(-1, points * axes, 3)


def shape_products(node_positions: np.ndarray) -> np.ndarray:
    """Return the integrals of products of two shape functions over ten-node tetrahedra (n_t, 10, 3), (n_t, 10, 10) m3."""
    return np.einsum("tj,klj->tkl", _coefficients(node_positions), _products())
