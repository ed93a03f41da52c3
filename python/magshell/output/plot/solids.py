"""Coloured triangles, of which everything in a panel consists: bodies, arrows and lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .colors import rgb

ARROW_SIDES = 12


@dataclass(frozen=True)
class Solid:
    """Triangles with colours.

    positions: (n, 3), m. faces: (m, 3). colors: from 0 to 1, (m, 3) for faces if `per_face`, otherwise (n, 3) for vertices.
    smooth: whether to shade with normals averaged at the vertices. lit: whether to shade at all.
    lift: m, a displacement towards the eye, so that other solids hide less of it; it is not visible in a parallel
        projection.
    opacity: 0 to 1.
    around: whether it belongs to the surroundings of bodies, which the window need not contain completely.
    """

    positions: np.ndarray
    faces: np.ndarray
    colors: np.ndarray
    per_face: bool
    smooth: bool = False
    lit: bool = True
    lift: float = 0.0
    opacity: float = 1.0
    around: bool = False


def sheet(positions: np.ndarray, faces: np.ndarray, colors: np.ndarray) -> Solid:
    """Make a smooth surface; colors: (3,), (n_f, 3) or (n_v, 3)."""
    if colors.ndim == 1:
        colors = np.broadcast_to(colors, (len(faces), 3))
    return Solid(positions, faces, colors, per_face=len(colors) == len(faces), smooth=True)


def ribbons(segments: np.ndarray, eye: np.ndarray, width: float, color: str, lift: float) -> Solid:
    """Make lines of segments (m, 2, 3) m as bands of two triangles each, perpendicular to the direction (3,) of the eye."""
    along = segments[:, 1] - segments[:, 0]
    across = np.cross(along, eye)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.divide(across, length, out=np.zeros_like(across), where=length > 0) * (0.5 * width)
    start, end = segments[:, 0], segments[:, 1]
    corners = np.stack([start - across, end - across, end + across, start + across], axis=1).reshape(-1, 3)
    first = 4 * np.arange(len(segments))[:, None, None]
    faces = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    colors = np.broadcast_to(rgb(color), (len(faces), 3))
    return Solid(corners, faces, colors, per_face=True, lit=False, lift=lift)


def arrows(starts: np.ndarray, vectors: np.ndarray, radius: float, color: str, lift: float = 0.0) -> Solid:
    """Make arrows of a shaft and a cone from starts (k, 3) m along vectors (k, 3) m; short arrows are thinner."""
    length = np.linalg.norm(vectors, axis=1)
    starts, vectors, length = starts[length > 0], vectors[length > 0], length[length > 0, None]
    along = vectors / length
    width = np.minimum(radius, 0.11 * length)[:, :, None]
    helper = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    side = np.cross(along, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(along, side)

    angles = 2 * np.pi * np.arange(ARROW_SIDES) / ARROW_SIDES
    circle = (
        np.cos(angles)[:, None] * side[:, None] + np.sin(angles)[:, None] * other[:, None]
    )  # (k, sides, 3)
    neck = starts + (length - np.minimum(0.55 * length, 6.5 * radius)) * along
    rings = [
        starts[:, None] + width * circle,
        neck[:, None] + width * circle,
        neck[:, None] + 2.6 * width * circle,
        np.broadcast_to((starts + vectors)[:, None], circle.shape),
    ]
    positions = np.stack(rings, axis=1).reshape(-1, 3)
    n = ARROW_SIDES
    here, there = np.arange(n), (np.arange(n) + 1) % n
    bands = [
        np.concatenate(
            [
                np.stack([a + here, a + there, a + n + there], 1),
                np.stack([a + here, a + n + there, a + n + here], 1),
            ]
        )
        for a in (0, n, 2 * n)
    ]
    bands[2] = bands[2][
        :n
    ]  # the ring at the tip has radius 0, so the second half of its triangles have no area
    bands.append(np.stack([np.zeros(n - 2, dtype=int), here[2:], here[1:-1]], 1))
    pattern = np.concatenate(bands)
    faces = (4 * n * np.arange(len(starts))[:, None, None] + pattern).reshape(-1, 3)
    colors = np.broadcast_to(rgb(color), (len(faces), 3))
    return Solid(positions, faces, colors, per_face=True, lift=lift)
