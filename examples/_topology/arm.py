"""The arm: a sheet held at its root, with a jaw at its end, and the scene of the part of it that is matter."""

from __future__ import annotations

import math
import time

import numpy as np
import torch

import magshell as ms

density = ms.parametrize.density

LENGTH, WIDTH, THICKNESS = 30e-3, 15e-3, 1e-3  # m
ROOT, JAW = 5e-3, 5e-3  # m, width of the held middle of an end, and length of the jaw at the other end
RADIUS = 2.2e-3  # m, of the filter
LEAST_WIDTH = 0.9e-3  # m, of matter and gaps, by the eroded and the dilated design
YOUNG_MODULUS, LIMIT, FLUX_DENSITY = 3e6, 60e3, 20e-3  # Pa, A/m, T
LOAD = 5e-4  # N, down, on the jaw
VOLUME = 0.5  # of the sheet
SOFT_VOID, LEFT_VOID = 1e-4, 1e-2  # of the modulus, in a sheet with void and in one without
SHARP = 8.0  # the sharpness from which on void is taken out


class Arm:
    """The equilibria of designs, with the field and without it; each solve starts from the last equilibrium."""

    def __init__(self, cells: tuple[int, int]):
        self.mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
        x, y, _ = self.mesh.face_barycenters.T
        self.root = np.flatnonzero((x < 1e-3) & (np.abs(y - 0.5 * WIDTH) < 0.5 * ROOT))
        self.jaw = np.flatnonzero(x > LENGTH - JAW)
        self.solid = np.union1d(self.root, self.jaw)
        self.filter = density.HelmholtzFilter(self.mesh, RADIUS)
        self.eroded_threshold = self.filter.eroded_threshold(LEAST_WIDTH)
        self.seconds = {"solves": 0.0, "scenes": 0.0}
        self.factorizations = 0
        self.matter: density.Matter | None = None
        self.equilibria: list[ms.Equilibrium] = []
        self._scene = self._sheet = None

    def filtered(self, variables: torch.Tensor) -> torch.Tensor:
        """Return the filtered densities of design variables (n_f,), with the solid faces."""
        return self.filter(density.fixed(variables, solid=self.solid))

    def density(self, variables: torch.Tensor, sharpness: float) -> torch.Tensor:
        """Return the densities of design variables (n_f,)."""
        return density.fixed(density.projected(self.filtered(variables), sharpness), solid=self.solid)

    def magnetization(self, directions: torch.Tensor) -> torch.Tensor:
        """Return the magnetization of solid matter, (n_f, 3) A/m, from directions (n_f, 3) in [-1, 1]."""
        smooth = torch.stack([2.0 * self.filter(0.5 * (1.0 + each)) - 1.0 for each in directions.T], dim=1)
        return ms.parametrize.softly_limited(3.0 * LIMIT * smooth, LIMIT)

    def strip(self) -> torch.Tensor:
        """Return the densities of a straight strip from the root to the jaw, with the volume of the designs."""
        width = (VOLUME * LENGTH - JAW) / (LENGTH - JAW) * WIDTH
        y = np.abs(self.mesh.face_barycenters[:, 1] - 0.5 * WIDTH)
        return density.fixed(1.0 * (y < 0.5 * width), solid=self.solid)

    def heights(
        self, densities: torch.Tensor, magnetization: torch.Tensor, angle: torch.Tensor, sharpness: float
    ) -> torch.Tensor:
        """Return the heights of the jaw in the field and without it, (2,) m. Raises DesignRejected if nothing holds it."""
        void_is_out = sharpness >= SHARP
        began = time.perf_counter()
        matter = density.Matter(self.mesh, densities, self.root, 0.1 if void_is_out else 0.0)
        starts = self._starts(matter)
        self.seconds["scenes"] += time.perf_counter() - began
        values = matter.values(
            young_modulus=YOUNG_MODULUS,
            remanent_magnetization=magnetization,
            void_stiffness=LEFT_VOID if void_is_out else SOFT_VOID,
        )
        field = FLUX_DENSITY * torch.stack([angle.cos(), 0.0 * angle, angle.sin()])
        began = time.perf_counter()
        found = [
            self._solve(values, each, start) for each, start in zip((field, 0.0 * field), starts, strict=True)
        ]
        self.seconds["solves"] += time.perf_counter() - began
        self.equilibria = found
        return torch.stack([each.positions[self._end, 2].mean() for each in found])

    def _starts(self, matter: density.Matter) -> list:
        """Take over the matter, and return starts of both solves; the scene is made anew if faces left or came."""
        if self.matter is not None and np.array_equal(matter.faces, self.matter.faces):
            return self.equilibria
        mesh = matter.mesh
        x, y, _ = mesh.edge_midpoints.T
        end = np.flatnonzero(mesh.rest_positions[:, 0] > LENGTH * (1.0 - 1e-6))
        if not np.isin(self.jaw, matter.faces).all():
            raise ms.DesignRejected("nothing holds the jaw")
        starts = [matter.start(self.matter, each.positions) for each in self.equilibria] or [None, None]
        self._sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS)
        root = np.flatnonzero((x < 1e-6 * LENGTH) & (np.abs(y - 0.5 * WIDTH) < 0.5 * ROOT))
        self._scene = ms.Scene(
            self._sheet,
            supports=[ms.Clamp(root)],
            loads=[ms.PointLoad(end, (0.0, 0.0, -LOAD / len(end)))],
            field=ms.UniformField(),
        )
        self.matter, self._end = matter, end
        return starts

    def _solve(self, values: dict, field: torch.Tensor, start) -> ms.Equilibrium:
        """Find an equilibrium from the last one, or from the flat sheet if that fails."""
        given = {"values": {self._sheet: values}, "applied_flux_density": field, "progress": False}
        try:
            found = ms.equilibrium(self._scene, start=start, **given)
        except ms.NotConverged:
            found = ms.equilibrium(self._scene, **given)
        self.factorizations += found.factorizations
        return found


def straight(arm: Arm) -> tuple[torch.Tensor, torch.Tensor]:
    """Return directions along the arm (n_f, 3), and the angle of a vertical field."""
    directions = torch.zeros(arm.mesh.n_faces, 3, dtype=torch.float64)
    directions[:, 0] = 0.6
    return directions, torch.tensor(0.5 * math.pi, dtype=torch.float64)
