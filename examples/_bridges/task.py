"""The sag of a bridge under its weight, as a function of the moduli of every tetrahedron."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

import magshell as ms

from .shape import Bridge

YOUNG_MODULUS, POISSON_RATIO = 2e5, 0.4  # Pa, 1: where the search starts, as [Qiao21]'s
MASS_DENSITY = 1e3  # kg/m3; not given in the paper
STEPS, TIME_STEP = 10, 5e-3  # s, as theirs
GRAVITY = 100.0  # m/s2, as in their code: at 9.81 nothing falls 8 cm in the 50 ms of these steps
SAG = 0.08  # m, of the mean node
LOG_RANGE = np.log(30.0)  # Young's modulus within 30 times of the start's either way
POISSON_RANGE = (0.05, 0.45)


@dataclass
class Task:
    """The fall of a bridge from rest. Unknowns are (2 n_t,): log(E / 2e5 Pa), then Poisson's ratio."""

    bridge: Bridge
    gravity: float = GRAVITY
    sag: float = SAG
    steps: int = STEPS
    simulations: int = 0

    @cached_property
    def solid(self) -> ms.Solid:
        material = ms.NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        return ms.Solid(self.bridge.mesh, material=material, mass_density=MASS_DENSITY, element="linear")

    @cached_property
    def scene(self) -> ms.Scene:
        return ms.Scene(self.solid, supports=[ms.Pin(self.bridge.held)], gravity=(0, 0, -self.gravity))

    @property
    def start(self) -> np.ndarray:
        n = self.bridge.mesh.n_tetrahedra
        return np.concatenate([np.zeros(n), np.full(n, POISSON_RATIO)])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        n = self.bridge.mesh.n_tetrahedra
        low, high = (-LOG_RANGE, POISSON_RANGE[0]), (LOG_RANGE, POISSON_RANGE[1])
        return np.repeat(low, n), np.repeat(high, n)

    def moduli(self, unknowns) -> dict:
        n = self.bridge.mesh.n_tetrahedra
        exp = torch.exp if isinstance(unknowns, torch.Tensor) else np.exp
        return {"young_modulus": YOUNG_MODULUS * exp(unknowns[:n]), "poisson_ratio": unknowns[n:]}

    def motion(self, unknowns, **options) -> ms.Trajectory:
        """Simulate the fall from rest, and count the simulation."""
        self.simulations += 1
        with warnings.catch_warnings():  # large strains are intended
            warnings.simplefilter("ignore", ms.LargeStrainWarning)
            return ms.simulate(
                self.scene,
                steps=self.steps,
                time_step=TIME_STEP,
                integrator=ms.ImplicitEuler(),
                progress=False,
                **self.moduli(unknowns),
                **options,
            )

    def distance(self, motion: ms.Trajectory):
        """Return the distance of the mean node at the end from its target, m."""
        moved = motion.displacements[-1].mean(0)
        target = (0.0, 0.0, -self.sag)
        away = moved - (moved.new_tensor(target) if isinstance(moved, torch.Tensor) else np.array(target))
        return (away**2).sum() ** 0.5

    def loss(self, unknowns):
        """Compute the square of the distance over the sag that is asked for."""
        return (self.distance(self.motion(unknowns)) / self.sag) ** 2
