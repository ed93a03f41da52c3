"""Quadrature points of faces and tetrahedra at which magnetic forces are compared."""

from __future__ import annotations

from functools import cache
from typing import Literal, NamedTuple

import numpy as np

from ... import _core
from ...mesh.tetrahedra.jacobian import shape_gradients
from ...mesh.topology import EDGES


class FacePoints(NamedTuple):
    """Points of a face: barycentric coordinates (n, 3), heights over the middle surface by the thickness, weights (n,)."""

    at: np.ndarray
    heights: np.ndarray
    weights: np.ndarray

    @staticmethod
    def fine() -> FacePoints:
        """Return the rule of three-node faces that sample finely."""
        rows = _core.fine_face_points()
        return FacePoints(rows[:, :3], rows[:, 3], rows[:, 4])

    @staticmethod
    def degree_4() -> FacePoints:
        """Return Dunavant's rule of degree 4, that of six-node faces."""
        a, b = 0.445948490915965, 0.091576213509771
        at = np.array([np.roll((each, each, 1.0 - 2.0 * each), turn) for each in (a, b) for turn in range(3)])
        weights = np.repeat([0.223381589678011, 0.109951743655322], 3)
        return FacePoints(at, np.zeros(len(at)), weights)

    @staticmethod
    def finer() -> FacePoints:
        """Return the rule that shows the error of the others: of degree 4 in each quarter of a face, at three levels."""
        inside, _, weights = FacePoints.degree_4()
        corners, middles = np.eye(3), 0.5 * (np.ones((3, 3)) - np.eye(3))
        quarters = [(corners[k], middles[(k + 1) % 3], middles[(k + 2) % 3]) for k in range(3)] + [
            tuple(middles)
        ]
        at = np.concatenate([inside @ np.array(quarter) for quarter in quarters])
        levels, of_levels = np.polynomial.legendre.leggauss(3)
        return FacePoints(
            np.tile(at, (3, 1)),
            np.repeat(0.5 * levels, len(at)),
            np.outer(0.5 * of_levels, np.tile(0.25 * weights, 4)).ravel(),
        )


@cache
def tetrahedron_rule(rule: Literal["own", "four", "fine", "finer"]) -> tuple[np.ndarray, np.ndarray]:
    """Return barycentric coordinates (p, 4) and weights (p,), which sum to 1/6.

    rule: "own" of four-node elements, "four", that of ten-node ones, "fine" of elements that sample finely, "finer" of those
    that show their error: Gauss' product rule of the cube, collapsed to a tetrahedron, four and six points along an edge.
    """
    if rule == "own":
        return np.full((1, 4), 0.25), np.full(1, 1.0 / 6.0)
    if rule == "four":
        a, b = (5.0 - np.sqrt(5.0)) / 20.0, (5.0 + 3.0 * np.sqrt(5.0)) / 20.0
        return a + (b - a) * np.eye(4), np.full(4, 1.0 / 24.0)
    line, lengths = np.polynomial.legendre.leggauss(4 if rule == "fine" else 6)
    u, v, w = (each.ravel() for each in np.meshgrid(*(3 * [0.5 * (line + 1.0)]), indexing="ij"))
    a, b, c = (each.ravel() for each in np.meshgrid(*(3 * [0.5 * lengths]), indexing="ij"))
    first, second, third = u, v * (1.0 - u), w * (1.0 - u) * (1.0 - v)
    at = np.stack([1.0 - first - second - third, first, second, third], axis=1)
    return at, a * b * c * (1.0 - u) ** 2 * (1.0 - v)


def ten_node_shapes(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the ten shape functions at barycentric coordinates (p, 4), (p, 10), and their derivatives by the last three
    coordinates, (p, 10, 3).
    """
    middle = 4.0 * points[:, EDGES[:, 0]] * points[:, EDGES[:, 1]]
    return np.concatenate([points * (2.0 * points - 1.0), middle], axis=1), shape_gradients(points)
