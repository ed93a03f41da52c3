"""Triangle meshes of obstacles for pictures, normals outwards: vertices (n, 3) m, faces (m, 3)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy

from ....mesh import generate as meshes

AROUND = 32  # cells around a round body
ROUNDED = 5  # cells across a rounded edge, on either side of its middle
FINE = 8  # rings from one point of a curve to the next


def sphere_surface(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of a ball around the origin."""
    mesh = meshes.spherical_cap(radius, 0.0, np.pi, cells=(AROUND, AROUND // 2))
    return mesh.rest_positions, mesh.faces


def box_surface(size: np.ndarray, rounding: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface of a box with rounded edges.

    The grids on the six sides of the sharp box are joined, then projected onto the rounded one.
    """
    half = size / 2
    inner = half - rounding
    steps = np.linspace(0, rounding, ROUNDED + 1) if rounding else np.zeros(1)
    lines = [np.unique(np.concatenate([-h + steps, h - steps])) for h in half]
    vertices, faces, count = [], [], 0
    for axis in range(3):
        u, v = lines[(axis + 1) % 3], lines[(axis + 2) % 3]
        grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
        quads = grid_faces(len(u), len(v))
        for side in (1, -1):
            points = np.empty((len(grid), 3))
            points[:, axis] = side * half[axis]
            points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = grid.T
            vertices.append(points)
            faces.append(count + quads[:, ::side])
            count += len(points)
    points, faces = _joined(np.concatenate(vertices), np.concatenate(faces))
    if rounding:
        nearest = np.clip(points, -inner, inner)
        away = points - nearest
        points = nearest + rounding * away / np.linalg.norm(away, axis=1, keepdims=True)
    return points, faces


def swept_surface(points: np.ndarray, radii: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the envelope of balls whose centers move through points (k, 3) m while their radii (k,) m change.

    A ball of the curve c and the radius r touches the envelope where the normal n has n . c' = - r'. The radius of an
    open one becomes constant towards its ends.
    """
    from scipy.interpolate import CubicSpline  # when needed, as loading it takes long

    knots, beyond = np.arange(len(points)), 0 if closed else 3
    curve = CubicSpline(knots, points)
    radius = CubicSpline(np.arange(-beyond, len(points) + beyond), np.pad(radii, beyond, mode="edge"))
    s = np.linspace(0, knots[-1], FINE * (len(points) - 1) + 1)
    speed = np.linalg.norm(curve(s, 1), axis=1, keepdims=True)
    frames = _frames(curve(s, 1) / speed)
    polar = np.arccos(-np.clip(radius(s, 1) / speed[:, 0], -1, 1))  # of n, from the direction of c'
    ring = np.arange(len(s))
    if closed:
        cap = np.linspace(0, 1, AROUND // 4 + 1)
        start, stop = np.pi + (polar[0] - np.pi) * cap[1:-1], polar[-1] * (1 - cap[1:-1])
        polar = np.concatenate([start, polar, stop])
        ring = np.concatenate([np.zeros(len(start), int), ring, np.full(len(stop), ring[-1])])
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    normals = np.cos(polar)[:, None, None] * frames[ring, None, 0] + np.sin(polar)[:, None, None] * (
        circle @ frames[ring][:, 1:]
    )
    vertices = (curve(s)[ring, None] + radius(s)[ring, None, None] * normals).reshape(-1, 3)
    here, there = np.arange(AROUND), (np.arange(AROUND) + 1) % AROUND
    first = AROUND * np.arange(len(ring) - 1)[:, None]
    a, b, c, d = (
        each.ravel() for each in (first + here, first + there, first + AROUND + there, first + AROUND + here)
    )
    faces = [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    if closed:
        n = len(vertices)
        poles = [points[0] - radii[0] * frames[0, 0], points[-1] + radii[-1] * frames[-1, 0]]
        vertices = np.concatenate([vertices, poles])
        last = n - AROUND
        faces.append(np.stack([there, here, np.full(AROUND, n)], axis=1))
        faces.append(np.stack([last + here, last + there, np.full(AROUND, n + 1)], axis=1))
    return vertices, np.concatenate(faces)


def grid_faces(n_u: int, n_v: int) -> np.ndarray:
    """Return the triangles of a grid of points in C order, whose normal is u x v."""
    a = (n_v * np.arange(n_u - 1)[:, None] + np.arange(n_v - 1)).ravel()
    b, c, d = a + n_v, a + n_v + 1, a + 1
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _frames(tangents: np.ndarray) -> np.ndarray:
    """Return orthonormal frames along a curve, (n, 3, 3); rows are the tangent and two normals that rotate as little as
    possible.
    """
    normal = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    normal /= np.linalg.norm(normal)
    frames = [np.stack([tangents[0], normal, np.cross(tangents[0], normal)])]
    for before, after in pairwise(tangents):
        axis = np.cross(before, after)
        sine = np.linalg.norm(axis)
        rotation = scipy.spatial.transform.Rotation.from_rotvec(
            axis / sine * np.arctan2(sine, before @ after) if sine > 0 else axis
        )
        frames.append(rotation.apply(frames[-1]))
    return np.array(frames)


def _joined(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge vertices at equal positions."""
    digits = np.round(vertices / np.abs(vertices).max(), 9)
    _, first, number = np.unique(digits, axis=0, return_index=True, return_inverse=True)
    return vertices[first], number.ravel()[faces]
