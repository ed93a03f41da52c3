"""Integrals of the shape functions of ten-node tetrahedra, curved ones exactly: everything is a polynomial.

With barycentric coordinates b on a tetrahedron of volume 1/6, the integral of a monomial b^p is p! / (|p| + 3)!.
"""

from __future__ import annotations

from functools import cache
from math import factorial

import numpy as np

from .tet_jacobian import POWERS, bent, jacobians, straight_volumes
from .tet_topology import EDGES

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
