"""Two strips with a magnetized end in a rotating field: one folds at a crease, one coils up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

MAGNETIZATION = 60e3  # A/m
THICKNESS = 4e-4  # m
MATERIAL = {"young_modulus": 5e5, "poisson_ratio": 0.45, "mass_density": 2e3}
LEAF, CREASE, FLAP, WIDTH = (
    21e-3,
    3e-3,
    18e-3,
    8e-3,
)  # m: the resting leaf, the crease, the leaf that rotates, the width
CREASE_THICKNESS = 1.5e-4
LENGTH, NARROW = 80e-3, 6e-3  # m, of the strip that coils up


@dataclass(frozen=True)
class Strip:
    """A strip that touches itself, in a field that rotates about y.

    flux_density: T; the field rotates against the sense in which a wheel rolls along x. angles: of the field, degrees
    from x towards z, in the order of the load steps. end: the vertices of the magnetized part.
    """

    scene: ms.Scene
    touch: ms.SelfContact
    flux_density: float
    angles: np.ndarray
    end: np.ndarray

    def field(self, angle: float) -> np.ndarray:
        turn = np.radians(angle)
        return self.flux_density * np.array([np.cos(turn), 0.0, np.sin(turn)])

    def states(self) -> list[ms.Equilibrium]:
        """Find the equilibrium in the field at every angle, each from the one before."""
        found: list[ms.Equilibrium] = []
        for angle in self.angles:
            start = found[-1] if found else None
            found.append(ms.equilibrium(self.scene, start=start, applied_flux_density=self.field(angle)))
        return found


def folding(cells: int = 42, angles: int = 12) -> Strip:
    """Build the strip that folds flat on a table and opens again.

    cells: along the strip, a multiple of 14. angles: number of field angles until it is folded flat.
    """
    length = LEAF + CREASE + FLAP
    mesh = ms.meshes.rectangle(length, WIDTH, cells=(cells, max(2, cells // 14)))
    x = mesh.face_barycenters[:, 0]
    shell = ms.Shell(
        mesh,
        thickness=np.where(np.abs(x - LEAF - CREASE / 2) < CREASE / 2, CREASE_THICKNESS, THICKNESS),
        remanent_magnetization=_along(np.where(x > LEAF + CREASE, -MAGNETIZATION, 0.0)),
        **MATERIAL,
    )
    touch = ms.SelfContact(shell)
    table = ms.obstacles.Plane(center=(0, 0, -THICKNESS / 2))
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        contacts=[touch, ms.Contact(table)],
        field=ms.UniformField(),
        gravity=(0, 0, -9.81),
    )
    there = np.linspace(180.0, 362.0, angles)
    end = mesh.vertices_where(lambda x: x[:, 0] > LEAF + CREASE - 1e-9)
    return Strip(scene, touch, 30e-3, np.concatenate([there, there[-2::-1]]), end)


def coiling(cells: int = 60, angles: int = 16) -> Strip:
    """Build the strip that coils up in nearly two rotations of the field.

    Its end is half as thick, so that it bends more and gets inside.
    """
    mesh = ms.meshes.rectangle(LENGTH, NARROW, cells=(cells, 2))
    x = mesh.face_barycenters[:, 0]
    shell = ms.Shell(
        mesh,
        thickness=THICKNESS * (1 - 0.5 * x / LENGTH),
        remanent_magnetization=_along(np.where(x > 0.85 * LENGTH, MAGNETIZATION, 0.0)),
        **MATERIAL,
    )
    touch = ms.SelfContact(shell)
    held = ms.Clamp(mesh.edges_at(x=0.0))
    scene = ms.Scene(shell, supports=[held], contacts=[touch], field=ms.UniformField())
    end = mesh.vertices_where(lambda x: x[:, 0] > 0.85 * LENGTH - 1e-9)
    return Strip(scene, touch, 40e-3, np.linspace(0.0, 660.0, angles), end)


def _along(strength: np.ndarray) -> np.ndarray:
    return strength[:, None] * np.array([1.0, 0.0, 0.0])
