"""The faces of a printable design: frozen ones, and the free ones as the variables of an optimizer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .printable_set import PrintableSet

if TYPE_CHECKING:
    import torch


class PrintedFaces:
    """Magnetizations over the ink's strength as components in axes of each face, (n_f, 3), with bounds.

    A free face has the axes of the ink, and bounds that enclose all printable magnetizations. A held (frozen) face
    has its direction as the first axis; only the component along it is variable, and with levels not even that.
    """

    axes: np.ndarray
    held: np.ndarray
    lower: np.ndarray
    components: np.ndarray
    upper: np.ndarray

    def __init__(self, ink: PrintableSet, remanent_magnetization: np.ndarray):
        count = len(remanent_magnetization)
        self.ink = ink
        self.axes = np.tile(np.eye(3), (count, 1, 1)) if ink.frames is None else ink.frames.copy()
        fullest = 1.0 if ink.levels is None else max(ink.levels)
        self.lower = np.tile(fullest * ink.directions.min(axis=0).clip(max=0.0), (count, 1))
        self.upper = np.tile(fullest * ink.directions.max(axis=0).clip(min=0.0), (count, 1))
        self.held = np.zeros(count, dtype=bool)
        components = np.einsum("fj,fij->fi", remanent_magnetization / ink.strength, self.axes)
        self.components = np.clip(components, self.lower, self.upper)

    @property
    def free(self) -> bool:
        """Return whether any variable is free."""
        return bool((self.upper > self.lower).any())

    @property
    def magnetization(self) -> np.ndarray:
        """The magnetization of each face, (n_f, 3) A/m."""
        return self.ink.strength * np.einsum("fi,fij->fj", self.components, self.axes)

    def magnetization_of(self, components: Any) -> torch.Tensor:
        """Return the magnetization for other components, (n_f, 3) A/m, as a tensor in their graph."""
        import torch

        return self.ink.strength * torch.einsum("fi,fij->fj", components, torch.from_numpy(self.axes))

    def nearest_to_printable(self, count: int) -> np.ndarray:
        """Return the free faces that are nearest to a printable magnetization, the nearest first, at most `count`."""
        distances = np.where(self.held, np.inf, self.ink.distances(self.magnetization))
        return np.argsort(distances, kind="stable")[: min(count, int((~self.held).sum()))]

    def freeze_nearest(self, faces: np.ndarray) -> None:
        """Freeze these faces at the nearest printable magnetizations."""
        directions, fractions = (each[faces] for each in self.ink.choices(self.magnetization))
        self.freeze(faces, directions, fractions)

    def freeze(self, faces: np.ndarray, directions: np.ndarray, fractions: Any) -> None:
        """Freeze faces in a direction of the ink, with a fraction of its strength. All (n,)."""
        self.held[faces] = True
        self.axes[faces] = _with_first(self.ink.rays_of(faces, directions))
        self.components[faces] = self.lower[faces] = self.upper[faces] = 0.0
        self.components[faces, 0] = self.lower[faces, 0] = self.upper[faces, 0] = fractions
        if self.ink.levels is None:
            self.lower[faces, 0], self.upper[faces, 0] = 0.0, 1.0

    def snapshot(self) -> tuple[Any, ...]:
        """Return a copy of the state for `restore`."""
        return tuple(each.copy() for each in (self.axes, self.lower, self.upper, self.held, self.components))

    def restore(self, snapshot: tuple[Any, ...]) -> None:
        """Return to the state that `snapshot` returned."""
        self.axes, self.lower, self.upper, self.held, self.components = (each.copy() for each in snapshot)


def _with_first(rays: np.ndarray) -> np.ndarray:
    """Return orthonormal axes (n, 3, 3) whose first ones are these unit vectors (n, 3)."""
    other = np.eye(3)[np.abs(rays).argmin(axis=1)]
    second = np.cross(rays, other)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([rays, second, np.cross(rays, second)], axis=1)
