"""The magnetization of flat faces in the deformed configuration."""

from __future__ import annotations

import numpy as np


def deformed_magnetization(
    rest: np.ndarray, corners: np.ndarray, magnetization: np.ndarray, rotates: np.ndarray | bool
) -> np.ndarray:
    """Return the magnetization of faces, F_0 M_r [Chen22] (20), or R M_r where it rotates only, (n, 3) A/m.

    rest, corners: the corners at rest and deformed, (n, 3, 3) m. magnetization: M_r, (n, 3) A/m. rotates: of all faces, or
    (n,).
    """
    before, after = frames_of(rest), frames_of(corners)
    coordinates = np.linalg.solve(before, magnetization[:, :, None])
    rotating = np.broadcast_to(rotates, len(rest))
    if rotating.any():
        axes = _rest_axes(before[rotating])
        coordinates = coordinates.copy()
        coordinates[rotating] = np.einsum("fji,fj->fi", axes, magnetization[rotating])[:, :, None]
        after[rotating] = _rotated_axes(before[rotating], after[rotating], axes)
    return (after @ coordinates)[:, :, 0]


def frames_of(corners: np.ndarray) -> np.ndarray:
    """Return the matrices of faces with the columns a_1, a_2 (edges) and unit normal, (n, 3, 3); corners: (n, 3, 3) m.

    The normal of a face without area is zero.
    """
    x0, x1, x2 = np.moveaxis(corners, 1, 0)
    normal = np.cross(x1 - x0, x2 - x0)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return np.stack([x1 - x0, x2 - x0, normal], axis=2)


def _rest_axes(frames: np.ndarray) -> np.ndarray:
    """Return orthonormal axes of faces as columns, the first along a_1 and the last along the normal, (n, 3, 3)."""
    first = frames[:, :, 0] / np.linalg.norm(frames[:, :, 0], axis=1, keepdims=True)
    return np.stack([first, np.cross(frames[:, :, 2], first), frames[:, :, 2]], axis=2)


def _rotated_axes(before: np.ndarray, after: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Return the axes turned by the rotation R of the polar decomposition F = R U, (n, 3, 3).

    R_1 = (F_1 + F_2 x n)/t, R_2 = (F_2 + n x F_1)/t with t the norm of either.
    """
    images = after @ np.linalg.solve(before, axes)
    f1, f2, normal = np.moveaxis(images, 2, 0)
    turned = np.stack([f1 + np.cross(f2, normal), f2 + np.cross(normal, f1)], axis=2)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    turned = np.divide(turned, length, out=np.zeros_like(turned), where=length > 0)
    return np.concatenate([turned, normal[:, :, None]], axis=2)
