"""Magnetic beads on a thread that is clamped at one end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

BEADS, SPACING, DIAMETER = 6, 6e-3, 3e-3  # number, m, m
WIDTH, THICKNESS = 3e-3, 3e-4  # m, of the thread
MASS = 6e-6  # kg, of a bead
MOMENT = 8e-3  # A m2
DIRECTIONS = {"along": (1.0, 0.0, 0.0), "across": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Chain:
    """A thread with its beads."""

    scene: ms.Scene
    beads: list[ms.RigidBody]

    def hanging(self, weight: float = 1.0, start=None) -> ms.Equilibrium:
        """Find the equilibrium under this part of the weight."""
        nothing = {"remanent_magnetization": (0, 0, 0), "applied_flux_density": (0, 0, 0)}
        return ms.equilibrium(self.scene, start=start, gravity_factor=weight, progress=False, **nothing)

    def sag(self, state: ms.Equilibrium) -> float:
        """Return how far the tip is below the clamp, in m."""
        tip = self.scene.mesh.vertices_at(x=BEADS * SPACING)
        return -float(np.asarray(state.displacements)[tip, 2].mean())


def chain(moments: str, own_field: bool, cells: int) -> Chain:
    """Build the chain. moments: "along" or "across" the thread. cells: of the thread for each bead, a multiple of four."""
    mesh = ms.meshes.rectangle(BEADS * SPACING, WIDTH, cells=(BEADS * cells, 2))
    thread = ms.Shell(mesh, thickness=THICKNESS, young_modulus=2e7, poisson_ratio=0.4, mass_density=1e3)
    beads = []
    for k in range(BEADS):
        center = ((k + 0.75) * SPACING, WIDTH / 2, 0.0)
        distance = np.abs(mesh.rest_positions[:, 0] - center[0])
        beads.append(
            ms.RigidBody(
                np.flatnonzero(distance < DIAMETER / 2 + 1e-9),
                body=thread,
                mass=MASS,
                inertia=MASS * DIAMETER**2 / 10,
                center=center,
                magnetic_moment=MOMENT * np.array(DIRECTIONS[moments]),
            )
        )
    scene = ms.Scene(
        [thread, *beads],
        supports=ms.Clamp(mesh.edges_at(x=0.0), body=thread),
        gravity=(0, 0, -9.81),
        field=ms.UniformField(),
        own_field=ms.OwnField(beads) if own_field else None,
    )
    return Chain(scene, beads)
