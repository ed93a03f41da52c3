"""Computes Jacobians of tetrahedra and integrals over them."""

from __future__ import annotations

from functools import cache
from itertools import product
from math import factorial

import numpy as np

from ..topology import EDGES

POWERS = np.array([powers for powers in product(range(4), repeat=4) if sum(powers) == 3])  # (20, 4)
_POINTS = POWERS / 3.0
_LEVELS = 4  # halvings that decide whether a polynomial with coefficients of both signs is positive


def _basis(points: np.ndarray) -> np.ndarray:
    """(n, 20): the polynomials of Bernstein at barycentric coordinates (n, 4)."""
    weights = [6 / np.prod([factorial(p) for p in powers]) for powers in POWERS.tolist()]
    return np.prod(points[:, None, :] ** POWERS, axis=2) * weights


_FROM_VALUES = np.linalg.inv(_basis(_POINTS))


def _gradients(points: np.ndarray) -> np.ndarray:
    """(n, 10, 3): derivatives of the ten shape functions by the last three of four barycentric coordinates (n, 4)."""
    corner = np.zeros((len(points), 10, 4))
    for i in range(4):
        corner[:, i, i] = 4 * points[:, i] - 1
    for k, (i, j) in enumerate(EDGES):
        corner[:, 4 + k, i] = 4 * points[:, j]
        corner[:, 4 + k, j] = 4 * points[:, i]
    return corner[:, :, 1:] - corner[:, :, :1]


def _halves() -> np.ndarray:
    """(8, 20, 20): the coefficients on each of eight parts of a tetrahedron from those on the whole."""
    corners = np.eye(4)
    middle = {(i, j): 0.5 * (corners[i] + corners[j]) for i in range(4) for j in range(4)}
    parts = [[middle[i, j] for j in range(4)] for i in range(4)]
    ring = [middle[0, 1], middle[1, 2], middle[2, 3], middle[0, 3]]
    parts += [[middle[0, 2], middle[1, 3], ring[k], ring[(k + 1) % 4]] for k in range(4)]
    return np.array([_FROM_VALUES @ _basis(_POINTS @ np.array(part)) for part in parts])


_PARTS = _halves()
_AT_POINTS = _gradients(_POINTS)


def straight_volumes(corner_positions: np.ndarray) -> np.ndarray:
    """(n_t,), m3, signed, of corners (n_t, 4, 3)."""
    a, b, c = np.moveaxis(corner_positions[:, 1:] - corner_positions[:, :1], 1, 0)
    return np.einsum("ti,ti->t", np.cross(a, b), c) / 6


def jacobians(node_positions: np.ndarray) -> np.ndarray:
    """(n_t, 20), m3: the coefficients of the Jacobian determinant of ten-node tetrahedra (n_t, 10, 3)."""
    values = np.linalg.det(np.einsum("pna,tni->tpia", _AT_POINTS, node_positions))
    return values @ _FROM_VALUES.T


def bent(node_positions: np.ndarray) -> np.ndarray:
    """(n_t,) bool: whether a node of (n_t, 10, 3) is not in the middle of its edge, by more than round-off. Others have
    the Jacobian of their corners everywhere."""
    ends = node_positions[:, EDGES]
    off = node_positions[:, 4:] - ends.mean(axis=2)
    lengths2 = np.square(ends[:, :, 1] - ends[:, :, 0]).sum(axis=2)
    return (np.square(off).sum(axis=2) > 1e-28 * lengths2).any(axis=1)


def quadratic_volumes(node_positions: np.ndarray) -> np.ndarray:
    """(n_t,), m3, signed, of ten-node tetrahedra (n_t, 10, 3)."""
    volumes = straight_volumes(node_positions[:, :4])
    curved = bent(node_positions)
    volumes[curved] = jacobians(node_positions[curved]).mean(axis=1) / 6
    return volumes


def least_jacobians(coefficients: np.ndarray) -> np.ndarray:
    """(n_t,), m3: the least value on each of the 20 points that decide a cubic polynomial."""
    return (coefficients @ _basis(_POINTS).T).min(axis=1)


def not_positive(coefficients: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """(n_t,) bool: whether the polynomial falls to its floor (n_t,) or below. What five halvings leave open counts."""
    bad = np.zeros(len(coefficients), dtype=bool)
    open_ones, owner = coefficients, np.arange(len(coefficients))
    for level in range(_LEVELS + 1):
        undecided = open_ones.min(axis=1) <= floor[owner]
        open_ones, owner = open_ones[undecided], owner[undecided]
        if len(owner) == 0:
            return bad
        bad[owner[least_jacobians(open_ones) <= floor[owner]]] = True
        going_on = ~bad[owner]
        open_ones, owner = open_ones[going_on], owner[going_on]
        if level < _LEVELS:
            open_ones = np.einsum("pij,tj->tpi", _PARTS, open_ones).reshape(-1, 20)
            owner = np.repeat(owner, 8)
    bad[owner] = True
    return bad


def shape_values(points: np.ndarray) -> np.ndarray:
    """(n, 10): the ten shape functions at barycentric coordinates (n, 4)."""
    at_corners = points * (2 * points - 1)
    return np.concatenate([at_corners, 4 * points[:, EDGES[:, 0]] * points[:, EDGES[:, 1]]], axis=1)


Polynomial = dict[tuple[int, ...], float]  # {powers of the four coordinates: factor}


def _shapes() -> list[Polynomial]:
    """All of the second degree in each monomial, as the coordinates add up to one."""
    one = np.eye(4, dtype=int)
    corners = [{tuple(one[i] + one[j]): 1.0 if i == j else -1.0 for j in range(4)} for i in range(4)]
    return corners + [{tuple(one[i] + one[j]): 4.0} for i, j in EDGES]


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    product: Polynomial = {}
    for p, x in a.items():
        for q, y in b.items():
            powers = tuple(np.add(p, q).tolist())
            product[powers] = product.get(powers, 0.0) + x * y
    return product


def _with_jacobian(polynomial: Polynomial) -> np.ndarray:
    """(20,): its integrals times each polynomial of Bernstein."""
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
    return np.array([_with_jacobian(shape) for shape in _shapes()])


@cache
def _products() -> np.ndarray:
    return np.array([[_with_jacobian(_product(a, b)) for b in _shapes()] for a in _shapes()])


def _coefficients(node_positions: np.ndarray) -> np.ndarray:
    """(n_t, 20), m3, of the Jacobian determinant: of straight tetrahedra all the same."""
    coefficients = np.repeat(6.0 * straight_volumes(node_positions[:, :4])[:, None], len(POWERS), axis=1)
    curved = bent(node_positions)
    coefficients[curved] = jacobians(node_positions[curved])
    return coefficients


def shape_integrals(node_positions: np.ndarray) -> np.ndarray:
    """(n_t, 10), m3: the integrals of the ten shape functions over ten-node tetrahedra (n_t, 10, 3). Of straight ones
    -1/20 of the volume at corners and 1/5 between them."""
    return _coefficients(node_positions) @ _integrals().T


def shape_products(node_positions: np.ndarray) -> np.ndarray:
    """(n_t, 10, 10), m3: the integrals of the products of two of them."""
    return np.einsum("tj,klj->tkl", _coefficients(node_positions), _products())
