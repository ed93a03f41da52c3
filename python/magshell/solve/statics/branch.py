"""The ways that a solve might have taken as well, since round-off decided between them and the way taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._runtime.frozen import immutable


@immutable
@dataclass(frozen=True, repr=False)
class Branch:
    """A way out of an unstable equilibrium that a solve did not take, though only round-off decided against it.

    saddle: (n_v, 3) m, the unstable equilibrium. positions: (n_v, 3) m, a state of lower energy on this way: as `start=` of
        ms.equilibrium it leads to the equilibrium on this side.
    cause: "other side" if the energy falls equally on both sides of the mode along which the solve left, within 1e-6 of its
        decrease. "other mode" if a second mode is as unstable, its eigenvalue the same within 1e-3; it may be left on both
        sides.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.04, 0.01, cells=(12, 3))
    >>> sheet = ms.Shell(mesh, thickness=1e-4, young_modulus=1e6)
    >>> pushed = ms.Clamp(mesh.edges_at(x=0.04), displacement=(-1e-5, 0, 0))
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0)), pushed])
    >>> up = ms.equilibrium(scene)  # the strip buckles to either side
    >>> branch = up.branches[0]
    >>> branch
    Branch: other side, of a mode that moves vertex 6 most
    >>> down = ms.equilibrium(scene, start=branch.positions)
    >>> bool(abs(up.positions - down.positions * (1, 1, -1)).max() < 1e-8)  # m
    True
    """

    saddle: np.ndarray
    positions: np.ndarray
    cause: str

    @property
    def mode(self) -> np.ndarray:
        """The displacement from the saddle along this way, (n_v, 3), its largest component 1 or -1."""
        moved = self.positions - self.saddle
        return moved / np.abs(moved).max()

    def __repr__(self) -> str:
        most = int(np.argmax(np.linalg.norm(self.positions - self.saddle, axis=1)))
        return f"Branch: {self.cause}, of a mode that moves vertex {most} most"
