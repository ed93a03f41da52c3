"""Two magnetized flaps above each other, held at one end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

LENGTH, WIDTH, THICKNESS, GAP = 20e-3, 6e-3, 3e-4, 8e-3  # m
MAGNETIZATION = 40e3  # A/m, along the upper flap, against the lower one
COATED = 6e-4  # m, least distance of the middle surfaces: a soft coat of 0.15 mm on both sides of each
MATERIAL = {"young_modulus": 5e6, "poisson_ratio": 0.45, "mass_density": 2e3}


@dataclass(frozen=True)
class Flaps:
    """Two flaps in a field along z, which opens them if it is positive.

    flaps: the lower one and the upper one.
    """

    scene: ms.Scene
    flaps: tuple[ms.Shell, ms.Shell]

    def opening(self, state: ms.Equilibrium) -> float:
        """Return the distance between the ends of the flaps, m."""
        lower, upper = (
            state[flap].positions[flap.mesh.vertices_at(x=LENGTH), 2].mean() for flap in self.flaps
        )
        return float(upper - lower)

    def states(self, flux_densities: np.ndarray) -> list[ms.Equilibrium]:
        """Find the equilibrium in each field [T], each from the one before."""
        found: list[ms.Equilibrium] = []
        for value in flux_densities:
            start = found[-1] if found else None
            found.append(ms.equilibrium(self.scene, start=start, applied_flux_density=(0, 0, value)))
        return found


def flaps(cells: tuple[int, int], own_field: bool) -> Flaps:
    """Build the flaps. own_field: whether they attract each other."""
    base = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells)
    both = tuple(
        ms.Shell(
            base.transformed(translation=(0.0, 0.0, side * GAP / 2)),
            thickness=THICKNESS,
            remanent_magnetization=(side * MAGNETIZATION, 0, 0),
            **MATERIAL,
        )
        for side in (-1, 1)
    )
    scene = ms.Scene(
        both,
        supports=[ms.Clamp(flap.mesh.edges_at(x=0.0), body=flap) for flap in both],
        contacts=[ms.Contact(*both, min_distance=COATED)],
        field=ms.UniformField(),
        own_field=ms.OwnField() if own_field else None,
    )
    return Flaps(scene, both)
