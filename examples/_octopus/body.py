"""The octopus: a bullet-shaped head of thin shell, open at the back, with six tentacles that are magnets."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import magshell as ms

# [Chen22] Table 1; 492 faces and 313 vertices, which the rings and rows below give.
THICKNESS = 1e-3  # m
YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e4, 0.5, 1e3  # Pa, 1, kg/m3

TENTACLES = 6
RINGS = (1, 2, 3, 4, 4)  # cells of the head's rings from the nose on, a tentacle's share of each
ROWS = (3,) * 10 + (1,)  # cells across a tentacle, from its root to its tip

RADIUS = 8e-3  # m, of the head
NOSE = 1.5  # its length over its radius
ROW = 2.4e-3  # m, the length of a row
SPREAD = np.radians(45.0)  # between a tentacle's tip and the axis
SLENDER = 0.45  # the width of a tentacle's last row but one, over that of its root
ROOT = np.pi / (TENTACLES * RINGS[-1]) * ROWS[0]  # half the azimuth that a root takes
MAGNETIZATION = 4e4  # A/m, along every tentacle, to its tip


@dataclass(frozen=True)
class Octopus:
    """The octopus in its reference shape along +x, the middle of the head's rim in the origin.

    tentacle: (n_f,) which tentacle a face belongs to, -1 in the head. remanent_magnetization: (n_f, 3) A/m.
    masses: (n_v,), a vertex's fraction of the total mass.
    """

    shell: ms.Shell
    tentacle: np.ndarray
    remanent_magnetization: np.ndarray
    masses: np.ndarray

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.shell.mesh


def octopus() -> Octopus:
    points, faces, tentacle, along = _sheet()
    mesh = ms.TriangleMesh(points, faces)
    shell = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
        bending="hinge",
    )
    masses = np.bincount(mesh.faces.ravel(), np.repeat(mesh.face_areas, 3), mesh.n_vertices)
    return Octopus(shell, tentacle, MAGNETIZATION * along, masses / masses.sum())


def _sheet() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, faces, the tentacle of each face, and the unit vector of its magnetization."""
    points, faces, owner, rings = [np.array([NOSE * RADIUS, 0.0, 0.0])], [], [], []
    for k, cells in enumerate(RINGS):
        number = TENTACLES * cells
        angle = 2 * np.pi * np.arange(number) / number - ROOT
        x, r = _head((k + 1) / len(RINGS))
        rings.append(len(points) + np.arange(number))
        points.extend(np.stack([np.full(number, x), r * np.cos(angle), r * np.sin(angle)], axis=1))
    faces += [(0, *pair) for pair in zip(rings[0], np.roll(rings[0], -1), strict=True)]
    for before, after in pairwise(rings):
        for j in range(TENTACLES):
            faces += _band(_part(before, j), _part(after, j))
    owner += [-1] * len(faces)
    for j in range(TENTACLES):
        row = _part(rings[-1], j)[: ROWS[0] + 1]
        for k in range(1, len(ROWS)):
            after = len(points) + np.arange(ROWS[k] + 1)
            points.extend(_row(k, 2 * np.pi * j / TENTACLES))
            band = _band(row, after)
            faces += band
            owner += [j] * len(band)
            row = after
    points, faces, owner = np.array(points), np.array(faces), np.array(owner)
    return points, faces, owner, _along(points[faces], owner)


def _part(ring: np.ndarray, j: int) -> np.ndarray:
    """Return the vertices of a ring over one tentacle's fraction of it, including the first vertex of the next."""
    cells = len(ring) // TENTACLES
    return np.roll(ring, -j * cells)[np.arange(cells + 1) % len(ring)]


def _band(before, after) -> list[tuple[int, int, int]]:
    """Return the faces between two rows of vertices; each face advances on the row whose next vertex is less far
    along.
    """
    faces, i, k = [], 0, 0
    n, m = len(before) - 1, len(after) - 1
    while i < n or k < m:
        if k == m or (i < n and (i + 0.5) * m < (k + 0.5) * n):
            faces.append((before[i], after[k], before[i + 1]))
            i += 1
        else:
            faces.append((before[i], after[k], after[k + 1]))
            k += 1
    return faces


def _head(fraction: float) -> tuple[float, float]:
    """Return x and r [m] of half an ellipse, at a fraction of its parameter."""
    return NOSE * RADIUS * np.cos(0.5 * np.pi * fraction), RADIUS * np.sin(0.5 * np.pi * fraction)


def _row(k: int, azimuth: float) -> np.ndarray:
    """Return the vertices of a tentacle's row k.

    Its middle line bends away from the axis evenly; the curvature across it, that of the head at the root, fades.
    """
    rows = len(ROWS) - 1
    turns = SPREAD * (np.arange(k) + 0.5) / rows
    x, r = -ROW * np.cos(turns).sum(), RADIUS + ROW * np.sin(turns).sum()
    angle = ROOT * np.linspace(-1.0, 1.0, ROWS[k] + 1)
    if ROWS[k] < ROWS[0]:
        angle = angle * ROWS[k] / ROWS[0]
    width = 1.0 - (1.0 - SLENDER) * k / (rows - 1)
    fade = max(0.0, 1.0 - k / 3)
    across = width * RADIUS * np.sin(angle)
    out = r - fade * RADIUS * (1.0 - np.cos(angle))
    c, s = np.cos(azimuth), np.sin(azimuth)
    return np.stack([np.full(len(angle), x), c * out - s * across, s * out + c * across], axis=1)


def _along(corners: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Return the direction towards the tip of each face's tentacle, in the plane of the face, (n_f, 3); zero in the
    head.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    azimuth = 2 * np.pi * owner / TENTACLES
    across = np.stack([np.zeros(len(owner)), -np.sin(azimuth), np.cos(azimuth)], axis=1)
    along = np.cross(across, normal)
    along *= -np.sign(along[:, :1])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.where(owner[:, None] < 0, 0.0, along)
