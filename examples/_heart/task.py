"""The heart as a scene, and the shape that it should contract to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

import magshell as ms

from .shape import UNIT, Chamber, Heart, as_tensor

YOUNG_MODULUS, POISSON_RATIO, MASS_DENSITY = 1e5, 0.45, 1e3  # Pa, 1, kg/m3: [Chen22] Table 1
THICKNESS = 1e-3  # m, of the skin: what [Chen22] has for sheets
FLUX_DENSITY = np.array([0.0, 0.05, 0.0])  # T, from front to back: as strong as [Chen22]'s strongest
LARGEST_MAGNETIZATION = (
    4e5  # A/m: a residual flux density of 0.5 T, as of flexible magnets; [Chen22] has no limit
)
THINNER, WIDER, LONGER = 0.2, 0.03, 0.04  # shares of y, x and z: the most contracted shape
BASE, WAIST = 36.0, 0.0  # units: held above the base; the contraction grows from there to the waist


def contracted(points: np.ndarray) -> np.ndarray:
    """Return the positions of points (n, 3) m in the most contracted shape: flatter from front to back, longer
    below.
    """
    x, y, z = np.moveaxis(points / UNIT, -1, 0)
    share = np.clip((BASE - z) / (BASE - WAIST), 0, 1)
    share = share**2 * (3 - 2 * share)
    moved = [(1 + WIDER * share) * x, (1 - THINNER * share) * y, z - LONGER * np.maximum(BASE - z, 0)]
    return UNIT * np.stack(moved, axis=-1)


@dataclass(frozen=True)
class Task:
    """A heart in a field from front to back, held above its base, with atria and vessel.

    area: "lower_half" or "ribbon", the part that has a magnetic skin.
    """

    heart: Heart
    area: str
    element: str

    @cached_property
    def solid(self) -> ms.Solid:
        return ms.Solid(
            self.heart.mesh,
            material=ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO),
            mass_density=MASS_DENSITY,
            element=self.element,
            skin=ms.Skin(thickness=THICKNESS, faces=getattr(self.heart, self.area)),
        )

    @cached_property
    def scene(self) -> ms.Scene:
        held = self.solid.mesh.vertices_where(lambda points: points[:, 2] > BASE * UNIT)
        return ms.Scene(self.solid, supports=[ms.Pin(held)], field=ms.UniformField())

    @cached_property
    def chamber(self) -> Chamber:
        return Chamber(self.solid.mesh)

    @property
    def n_designed(self) -> int:
        """The number of faces with a magnetization of their own: those of the tetrahedra, whatever their order."""
        return len(getattr(self.heart, self.area))

    def of_skin(self, magnetization):
        """Return the magnetization (k, 3) for `solid.skin` from that of the designed faces, (n_designed, 3) A/m.

        A face of a ten-node tetrahedron has four flat triangles.
        """
        repeats = len(self.solid.skin.faces) // self.n_designed
        if isinstance(magnetization, torch.Tensor):
            return magnetization.repeat_interleave(repeats, dim=0)
        return np.repeat(magnetization, repeats, axis=0)

    @cached_property
    def _weights(self) -> np.ndarray:
        """The fraction of the surface that belongs to each vertex, (n_v,); it makes distances on all meshes
        comparable.
        """
        mesh, weights = self.solid.mesh, np.zeros(self.solid.mesh.n_vertices)
        np.add.at(weights, mesh.faces, mesh.face_areas[:, None] / 3)
        return weights / weights.sum()

    @cached_property
    def target(self) -> np.ndarray:
        """The target positions of the vertices, (n_v, 3) m."""
        return contracted(self.solid.mesh.rest_positions)

    @cached_property
    def target_distance(self) -> float:
        """The root mean square distance of the reference surface from the target, m."""
        return self.rms_error(self.solid.mesh.rest_positions)

    def square(self, positions: torch.Tensor) -> torch.Tensor:
        """Compute the mean over the surface of the squared distance from the target, m2."""
        return ms.objectives.shape_matching(positions, torch.from_numpy(self.target), weights=self._weights)

    def rms_error(self, positions) -> float:
        """Compute the root mean square distance of the surface from the target, m."""
        return float(self.square(as_tensor(positions))) ** 0.5

    def at_rest(self, of_skin: np.ndarray, flux_density=FLUX_DENSITY) -> ms.Equilibrium:
        """Find the equilibrium with the field turned on, from the reference shape.

        of_skin: (k, 3) A/m; flux_density: (3,) T.
        """
        return ms.equilibrium(
            self.scene,
            applied_flux_density=flux_density,
            values={self.solid.skin: {"remanent_magnetization": of_skin}},
        )
