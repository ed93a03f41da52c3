"""The faces of a design that is to be printed: what of each is still free, as the variables of an optimizer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .ink import PrintableSet

if TYPE_CHECKING:
    import torch


class PrintedFaces:
    """Magnetizations as shares of the ink's strength in axes of each face, (n_f, 3), with bounds.

    A face that is free has the axes of the ink and the box around all that can be printed. One that is held has its
    direction as the first axis, and of that only the share is left to find, or nothing where the ink has levels.
    """

    axes: np.ndarray
    held: np.ndarray
    lower: np.ndarray
    shares: np.ndarray
    upper: np.ndarray

    def __init__(self, ink: PrintableSet, remanent_magnetization: np.ndarray):
        count = len(remanent_magnetization)
        self.ink = ink
        self.axes = np.tile(np.eye(3), (count, 1, 1)) if ink.frames is None else ink.frames.copy()
        fullest = 1.0 if ink.levels is None else max(ink.levels)
        self.lower = np.tile(fullest * ink.directions.min(axis=0).clip(max=0.0), (count, 1))
        self.upper = np.tile(fullest * ink.directions.max(axis=0).clip(min=0.0), (count, 1))
        self.held = np.zeros(count, dtype=bool)
        shares = np.einsum("fj,fij->fi", remanent_magnetization / ink.strength, self.axes)
        self.shares = np.clip(shares, self.lower, self.upper)

    @property
    def free(self) -> bool:
        """Whether anything is left to find."""
        return bool((self.upper > self.lower).any())

    @property
    def magnetization(self) -> np.ndarray:
        """(n_f, 3) A/m."""
        return self.ink.strength * np.einsum("fi,fij->fj", self.shares, self.axes)

    def magnetization_of(self, shares: Any) -> torch.Tensor:
        """(n_f, 3) A/m of other shares, a tensor in their graph."""
        import torch

        return self.ink.strength * torch.einsum("fi,fij->fj", shares, torch.from_numpy(self.axes))

    def surest(self, count: int) -> np.ndarray:
        """The faces not held that are nearest to what can be printed, the nearest first."""
        distances = np.where(self.held, np.inf, self.ink.distances(self.magnetization))
        return np.argsort(distances, kind="stable")[: min(count, int((~self.held).sum()))]

    def hold(self, faces: np.ndarray) -> None:
        """Moves these faces to the nearest that can be printed, and holds them there."""
        directions, shares = (each[faces] for each in self.ink.choices(self.magnetization))
        self.put(faces, directions, shares)

    def put(self, faces: np.ndarray, directions: np.ndarray, shares: Any) -> None:
        """Gives faces a direction of the ink and a share of its strength, and holds them. All (n,)."""
        self.held[faces] = True
        self.axes[faces] = _with_first(self.ink.rays_of(faces, directions))
        self.shares[faces] = self.lower[faces] = self.upper[faces] = 0.0
        self.shares[faces, 0] = self.lower[faces, 0] = self.upper[faces, 0] = shares
        if self.ink.levels is None:
            self.lower[faces, 0], self.upper[faces, 0] = 0.0, 1.0

    def kept(self) -> tuple[Any, ...]:
        """What `restore` goes back to."""
        return tuple(each.copy() for each in (self.axes, self.lower, self.upper, self.held, self.shares))

    def restore(self, kept: tuple[Any, ...]) -> None:
        self.axes, self.lower, self.upper, self.held, self.shares = (each.copy() for each in kept)


def _with_first(rays: np.ndarray) -> np.ndarray:
    """(n, 3, 3): orthonormal axes of which these unit vectors (n, 3) are the first."""
    other = np.eye(3)[np.abs(rays).argmin(axis=1)]
    second = np.cross(rays, other)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([rays, second, np.cross(rays, second)], axis=1)
