"""The beam, its design, and the fields at which it snaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

import magshell as ms

# The beam of Tan et al., as in bistable_beam.py.
LENGTH, WIDTH, THICKNESS, SHORTENING = 120.47e-3, 20e-3, 2.5e-3, 0.47e-3  # m
YOUNG_MODULUS, RESIDUAL_FLUX_DENSITY = 4.2e6, 67.5e-3  # Pa, T
TILT = 5e-3  # rad, by which the left clamp is turned in error: a real beam buckles to no side exactly evenly
HIGHEST_FIELD = 16e-3  # T, where the paths end
NAMES = ("shortening", "mean thickness", "thickness of the ends over the middle", "rotation of the clamps")
SIZES = (0.2, 0.2, 0.2, 0.02)  # of the variables: three logarithms of ratios, and rad


@dataclass(frozen=True)
class Snaps:
    """The path of one design, and the fields at which it snaps through and back, T; tensors if the design is one."""

    path: ms.EquilibriumPath
    through: torch.Tensor
    back: torch.Tensor

    def fields(self) -> torch.Tensor:
        """Return both fields, (2,) T."""
        return torch.stack([self.through, self.back])


class Beam:
    """The clamped beam, as a function of a design (4,): NAMES."""

    def __init__(self, cells: tuple[int, int]):
        self.mesh: ms.TriangleMesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
        self.sheet: ms.Shell = ms.Shell(
            self.mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.5
        )
        ends = ((0.0, SHORTENING / 2), (LENGTH, -SHORTENING / 2))
        self.clamps: list[ms.Clamp] = [
            ms.Clamp(self.mesh.edges_at(x=x), displacement=(u, 0, 0), rotation=(0, 0, 0)) for x, u in ends
        ]
        self.scene: ms.Scene = ms.Scene(self.sheet, supports=self.clamps, field=ms.UniformField())
        x = self.mesh.face_barycenters[:, 0]
        self.wave: torch.Tensor = torch.from_numpy(0.5 * np.cos(2 * np.pi * x / LENGTH))
        self.magnetization: np.ndarray = np.zeros((self.mesh.n_faces, 3))
        self.magnetization[:, 0] = np.sign(x - LENGTH / 2) * ms.magnetization_from_remanence(
            RESIDUAL_FLUX_DENSITY
        )
        rows = self.mesh.rest_positions
        middle = np.flatnonzero(np.abs(rows[:, 1] - WIDTH / 2) < 1e-9)
        self.line: np.ndarray = middle[np.argsort(rows[middle, 0])]  # vertices of the center line
        self.middle: int = self.mesh.nearest_vertex((LENGTH / 2, WIDTH / 2, 0))

    def thickness(self, design: torch.Tensor) -> torch.Tensor:
        """Return the thickness of each face, (n_f,) m."""
        return THICKNESS * torch.exp(design[1] + design[2] * self.wave)

    def given(self, design: torch.Tensor) -> dict:
        """Return what solves take for this design, beside the field."""
        x, y, _ = torch.eye(3, dtype=torch.float64)
        left, right = self.clamps
        inwards = 0.5 * SHORTENING * torch.exp(design[0]) * x
        values = {
            self.sheet: {"thickness": self.thickness(design)},
            left: {"displacement": inwards, "rotation": (TILT - design[3]) * y},
            right: {"displacement": -inwards, "rotation": design[3] * y},
        }
        return {"values": values, "remanent_magnetization": self.magnetization}

    def at_rest(self, design: torch.Tensor, field: float = 0.0, start=None) -> ms.Equilibrium:
        """Find an equilibrium under a field [T] along z; by default the one buckled to the side +z."""
        with torch.no_grad():
            given = self.given(design)
            if start is None:
                start = ms.equilibrium(self.scene, applied_flux_density=(0, 0, -HIGHEST_FIELD), **given)
            return ms.equilibrium(self.scene, applied_flux_density=(0, 0, field), start=start, **given)

    def snaps(self, design: torch.Tensor, max_step: float = 0.02) -> Snaps:
        """Follow the path through both snaps: up to the first, over unstable states, down to the second, and on."""
        path = ms.follow_path(
            self.scene,
            start=self.at_rest(design),
            applied_flux_density=(0, 0, HIGHEST_FIELD),
            max_step=max_step,
            min_parameter=-2.0,
            progress=False,
            solver=ms.MixedNewton(tolerance=1e-12),
            **self.given(design),
        )
        if len(path.critical) < 2:
            raise ms.DesignRejected("this beam does not snap")
        first, last = path.critical[0], path.critical[-1]
        return Snaps(path, HIGHEST_FIELD * first.parameter, HIGHEST_FIELD * last.parameter)

    def height(self, rest: ms.Equilibrium) -> float:
        """Return the height of mid-span, m."""
        return float(rest.positions[self.middle, 2])
