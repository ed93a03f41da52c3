"""The hexagram: its outline, its mesh, and its shape with the arms rolled."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

import magshell as ms

SIDE = 20e-3  # m, of the hexagon in the middle and of the arms, equilateral triangles on its sides
ARM_LENGTH = np.sqrt(0.75) * SIDE  # m, from an arm's root, a side of the hexagon, to its tip
ROOT_DISTANCE = np.sqrt(0.75) * SIDE  # m, from the center to the roots
ARM_ANGLES = np.radians(60.0) * np.arange(6)  # from the x axis to each arm's axis

_SMOOTHINGS = 40
_CLEARANCE = 0.6  # of an edge of the outline: no vertex closer to outline or roots at the start


def hexagram(edges_per_side: int, n_vertices: int) -> ms.TriangleMesh:
    """Build the sheet in the plane z = 0, its center at the origin, its arms' roots along edges of the mesh.

    Each of the outline's 12 sides has `edges_per_side` edges. By Euler's formula a triangulation of n_v
    vertices, n_b of them on the outline, has 2 n_v - 2 - n_b faces: 1097 vertices and 12 edges a side give
    the 2048 faces of [Chen22] Table 1. (2048 is 3 x 682 + 2: no mesh of so many faces has the threefold
    symmetry of the star.)
    """
    outline = _outline(edges_per_side)
    fixed = np.concatenate([outline, _roots_and_center(edges_per_side)])
    points = np.concatenate([fixed, _filling(fixed, n_vertices - len(fixed), SIDE / edges_per_side)])
    for _ in range(_SMOOTHINGS):
        points[len(fixed) :] = _centroids_around(points, _triangles(points))[len(fixed) :]
    faces = _triangles(points)
    if len(faces) != 2 * n_vertices - 2 - len(outline):
        raise ValueError(f"no mesh of {n_vertices} vertices keeps {edges_per_side} edges a side as edges")
    return ms.TriangleMesh(np.column_stack([points, np.zeros(len(points))]), faces)


def rolled(rest_positions: np.ndarray, angle: float) -> np.ndarray:
    """Return the positions (n_v, 3) m with every arm rolled isometrically about its root and the hexagon flat.

    An arm becomes a piece of a circular cylinder whose axis is parallel to its root. With s the distance of a
    point from the root at rest, and the curvature k = angle / ARM_LENGTH constant up to the tip,

        s -> sin(k s) / k outwards and -(1 - cos(k s)) / k upwards,

    while its coordinate along the root stays. The map preserves lengths and angles, and the tangent is continuous at
    the root. angle: rotation of the tip in rad, positive downwards.
    """
    curvature = angle / ARM_LENGTH
    positions = np.array(rest_positions)
    arm, s = arm_coordinates(rest_positions)
    for number, azimuth in enumerate(ARM_ANGLES):
        outwards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        on_arm = (arm == number) & (s > 0.0)
        turned = curvature * s[on_arm]
        # sinc and (1 - cos) in forms that keep their digits as the angle goes to zero
        forward = s[on_arm] * np.sinc(turned / np.pi)
        down = 0.5 * s[on_arm] * turned * np.sinc(0.5 * turned / np.pi) ** 2
        positions[on_arm] += (forward - s[on_arm])[:, None] * outwards
        positions[on_arm, 2] -= down
    return positions


def arm_coordinates(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the arm (0 to 5) nearest to each point (n, 3), and the distance s [m] outwards from its root."""
    outwards = np.column_stack([np.cos(ARM_ANGLES), np.sin(ARM_ANGLES)])
    distances = points[:, :2] @ outwards.T - ROOT_DISTANCE
    arm = distances.argmax(axis=1)
    return arm, distances[np.arange(len(points)), arm]


def tips(mesh: ms.TriangleMesh) -> np.ndarray:
    """Return the vertices at the six tips, (6,)."""
    return _at(mesh, np.sqrt(3.0) * SIDE, ARM_ANGLES)


def feet(mesh: ms.TriangleMesh) -> np.ndarray:
    """Return the vertices at every second corner of the hexagon, (3,), the first on the y axis."""
    return _at(mesh, SIDE, np.radians([90.0, 210.0, 330.0]))


def center(mesh: ms.TriangleMesh) -> int:
    """Return the vertex in the middle."""
    return int(_at(mesh, 0.0, np.zeros(1))[0])


def _at(mesh: ms.TriangleMesh, radius: float, angles: np.ndarray) -> np.ndarray:
    points = radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    return np.array([mesh.nearest_vertex(point) for point in points])


def _corners() -> tuple[np.ndarray, np.ndarray]:
    """Return the tips and the corners of the hexagon, (6, 2) each; corner k follows tip k along the outline."""

    def ring(radius, angles):
        return radius * np.column_stack([np.cos(angles), np.sin(angles)])

    return ring(np.sqrt(3.0) * SIDE, ARM_ANGLES), ring(SIDE, ARM_ANGLES + np.radians(30.0))


def _outline(edges_per_side: int) -> np.ndarray:
    tip, corner = _corners()
    corners = np.stack([tip, corner], axis=1).reshape(12, 2)
    return np.concatenate(
        [_divided(*ends, edges_per_side) for ends in zip(corners, np.roll(corners, -1, 0), strict=True)]
    )


def _roots_and_center(edges_per_side: int) -> np.ndarray:
    """Return the vertices along the roots, without their ends, and the center."""
    _, corner = _corners()
    roots = [_divided(*ends, edges_per_side)[1:] for ends in zip(corner, np.roll(corner, -1, 0), strict=True)]
    return np.concatenate([*roots, np.zeros((1, 2))])


def _divided(start: np.ndarray, end: np.ndarray, parts: int) -> np.ndarray:
    """Return evenly spaced points from start to end, without the end."""
    return start + np.arange(parts)[:, None] / parts * (end - start)


def _filling(fixed: np.ndarray, count: int, edge: float) -> np.ndarray:
    """Return `count` points of the coarsest possible triangular lattice that are clear of the fixed points."""
    rows, columns = np.meshgrid(np.arange(-200, 200), np.arange(-200, 200), indexing="ij")
    lattice = np.column_stack([(columns + 0.5 * rows).ravel() + 0.25, np.sqrt(0.75) * (rows.ravel() + 0.25)])
    spacing = 1.1 * edge
    while True:
        points = spacing * lattice
        points = points[_inside(points)]
        distance = np.linalg.norm(points[:, None] - fixed, axis=-1).min(axis=1)
        if (distance > _CLEARANCE * edge).sum() >= count:
            return points[np.argsort(-distance, kind="stable")[:count]]
        spacing *= 0.995


def _triangles(points: np.ndarray) -> np.ndarray:
    """Return the Delaunay faces inside the star, counter-clockwise, (n_f, 3)."""
    faces = Delaunay(points).simplices
    faces = faces[_inside(points[faces].mean(axis=1))]
    first, second = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    backwards = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    return np.where(backwards[:, None], faces[:, ::-1], faces)


def _inside(points: np.ndarray) -> np.ndarray:
    """Return whether points (n, 2) lie within one of the two triangles that make up the star."""
    distances = points @ np.stack([np.cos(ARM_ANGLES), np.sin(ARM_ANGLES)])
    triangles = distances[:, 0::2].max(axis=1), distances[:, 1::2].max(axis=1)
    return np.minimum(*triangles) < ROOT_DISTANCE


def _centroids_around(points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the mean of the centroids of the faces around each point, weighted by their areas."""
    first, second = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    areas = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    moments = areas[:, None] * points[faces].mean(axis=1)
    sums, weights = np.zeros_like(points), np.zeros(len(points))
    np.add.at(sums, faces, moments[:, None])
    np.add.at(weights, faces, areas[:, None])
    return sums / weights[:, None]
