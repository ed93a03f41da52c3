"""A magnetized strip that a field folds at a crease."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

LEAF, CREASE, WIDTH = 18e-3, 3e-3, 8e-3  # m: each leaf, the crease between them, the width
THICKNESS, CREASE_THICKNESS = 4e-4, 1e-4  # m
MAGNETIZATION = 60e3  # A/m, along the strip
COATED = 6e-4  # m, least distance of the middle surfaces of both leaves: a soft coat of 0.1 mm on both sides
MATERIAL = {"young_modulus": 5e5, "poisson_ratio": 0.45, "mass_density": 2e3}
FOLDING = 30e-3  # T, of the field that turns and folds the strip
LAST_ANGLE = 170.0  # degrees, at which it stops and gets weaker


@dataclass(frozen=True)
class Leaves:
    """A strip whose left leaf is glued to a table, and whose right leaf is free."""

    scene: ms.Scene
    shell: ms.Shell

    def angle(self, state: ms.Equilibrium) -> float:
        """Return the angle of the free leaf about the crease, degrees: 0 when flat, 180 when folded."""
        mesh = self.shell.mesh
        ends = (mesh.vertices_at(x=LEAF + CREASE), mesh.vertices_at(x=mesh.rest_positions[:, 0].max()))
        begin, end = (state.positions[rows].mean(axis=0) for rows in ends)
        angle = np.degrees(np.arctan2(end[2] - begin[2], end[0] - begin[0]))
        return float(angle + 360.0 if angle < -90.0 else angle)

    def states(self, program: list[tuple[float, float]]) -> list[ms.Equilibrium]:
        """Find the equilibrium for each flux density [T] and angle of the field [degrees from x to z], each from the one
        before.
        """
        found: list[ms.Equilibrium] = []
        for strength, angle in program:
            turn = np.radians(angle)
            flux_density = strength * np.array([np.cos(turn), 0.0, np.sin(turn)])
            start = found[-1] if found else None
            found.append(ms.equilibrium(self.scene, start=start, applied_flux_density=flux_density))
        return found


def program(opening: int) -> list[tuple[float, float]]:
    """Return the fields (T, degrees): one that turns, gets weaker and ends; and one straight up of 2 mT times 1 to
    `opening`.
    """
    turning = [(FOLDING, angle) for angle in np.linspace(0.0, LAST_ANGLE, 8)]
    fading = [(strength * 1e-3, LAST_ANGLE) for strength in (20, 10, 5, 2, 0)]
    return [*turning, *fading, *((2e-3 * k, 90.0) for k in range(1, opening + 1))]


def folding_strip(cells: int, own_field: bool) -> Leaves:
    """Build the strip. cells: along it, a multiple of 13. own_field: whether its parts attract each other."""
    length = 2 * LEAF + CREASE
    mesh = ms.meshes.rectangle(length, WIDTH, cells=(cells, max(2, cells // 6)))
    in_crease = np.abs(mesh.face_barycenters[:, 0] - length / 2) < CREASE / 2
    shell = ms.Shell(
        mesh,
        thickness=np.where(in_crease, CREASE_THICKNESS, THICKNESS),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        **MATERIAL,
    )
    glued = mesh.vertices_where(lambda x: x[:, 0] < LEAF + 1e-9)
    left = mesh.vertices_at(x=0.0)
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(mesh.edges_at(x=0.0)), ms.Pin(np.setdiff1d(glued, left))],
        contacts=[ms.SelfContact(shell, min_distance=COATED)],
        field=ms.UniformField(),
        own_field=ms.OwnField() if own_field else None,
    )
    return Leaves(scene, shell)
