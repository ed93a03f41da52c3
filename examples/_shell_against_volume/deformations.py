"""A plate (x along, y across, z from its middle surface, all m) bent to an arc, and twisted to a helicoid."""

from __future__ import annotations

import numpy as np

LENGTH, WIDTH, THICKNESS = 1.0, 0.25, 0.02


def bent(points: np.ndarray, angle: float) -> np.ndarray:
    """Return the positions of the plate bent to an arc of this angle; normals stay straight and of unit length."""
    x, y, z = points.T
    radius = LENGTH / angle
    turn = x / radius
    return np.stack(
        [(radius - z) * np.sin(turn), y, radius - (radius - z) * np.cos(turn)],
        axis=1,
    )


def twisted(points: np.ndarray, angle: float) -> np.ndarray:
    """Return the positions of the plate with its middle surface twisted to a helicoid whose ends are rotated by this
    angle.

    Normals of that surface, (x, y cos a, y sin a) with a = angle x / LENGTH, stay straight and of unit length.
    """
    x, y, z = points.T
    y = y - 0.5 * WIDTH
    rate = angle / LENGTH
    turn = rate * x
    stretch = np.sqrt(1 + (rate * y) ** 2)
    normal = np.stack([-rate * y, -np.sin(turn), np.cos(turn)], axis=1) / stretch[:, None]
    return np.stack([x, y * np.cos(turn), y * np.sin(turn)], axis=1) + z[:, None] * normal


def sheared_twist(points: np.ndarray, angle: float) -> np.ndarray:
    """Return the positions with the same twist and rigidly rotated sections, so that normals incline, unlike
    Kirchhoff's.
    """
    x, y, z = points.T
    y = y - 0.5 * WIDTH
    turn = angle / LENGTH * x
    return np.stack([x, y * np.cos(turn) - z * np.sin(turn), y * np.sin(turn) + z * np.cos(turn)], axis=1)


DEFORMATIONS = {"bent": bent, "twisted": twisted, "twisted, sheared": sheared_twist}
