"""The strip, and the curves that its tip is to follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms
from magshell import control

# [Chen22] Table 1 and 6.1.
YOUNG_MODULUS, POISSON_RATIO = 1e5, 0.5  # Pa
DAMPING = 1e-4  # N s/m, on each of the vertices of its mesh
TIME_STEP = 1e-3  # s
LIMIT = 0.05  # T, of each component of the field
CELLS = (24, 8)  # crossed: 768 faces and 417 vertices, as in the table; no other grid has both numbers
PAPER = {  # steps (a third of the table's unknowns m), residual (without a unit), iterations, s an iteration
    "L": {"steps": 167, "residual": 3.8e-5, "iterations": 463, "seconds": 4.4e4 / 463},
    "C": {"steps": 100, "residual": 2.3e-5, "iterations": 241, "seconds": 1.6e4 / 241},
}

# Not printed there.
LENGTH, WIDTH, THICKNESS = 30e-3, 10e-3, 1e-3  # m
MASS_DENSITY = 1.1e3  # kg/m3, silicone's
RESIDUAL_FLUX_DENSITY = 25e-3  # T
# Weights of the three terms; with smaller ones a tip that starts millimetres along the curve costs too little.
WEIGHTS = (10.0, 10.0, 1.0)


@dataclass(frozen=True)
class Strip:
    """A scene, its magnetization (n_f, 3) [A/m], the vertex in the middle of the free end, and damping [N s/m]."""

    scene: ms.Scene
    remanent_magnetization: np.ndarray
    tip: int
    damping: float

    def move(self, field, steps: int, *, integrator, time_step=TIME_STEP, **options) -> ms.Trajectory:
        """Simulate the motion from rest, in a field [T] that varies in time."""
        return ms.simulate(
            self.scene,
            steps=steps,
            time_step=time_step,
            remanent_magnetization=self.remanent_magnetization,
            applied_flux_density=field,
            damping=self.damping,
            integrator=integrator,
            progress=False,
            **options,
        )

    @property
    def midline(self) -> np.ndarray:
        """The vertices from the clamp to the tip."""
        rest = self.scene.mesh.rest_positions
        middle = np.flatnonzero(np.isclose(rest[:, 1], WIDTH / 2))
        return middle[np.argsort(rest[middle, 0])]


def strip(cells=CELLS) -> Strip:
    """Build the strip, clamped at its left end.

    The clamped half is magnetized along the strip, the free half through its thickness. cells: along x and y, an even
    number along y. The total damping is the same on every mesh.
    """
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, diagonals="crossed")
    sheet = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=POISSON_RATIO,
        mass_density=MASS_DENSITY,
    )
    scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], field=ms.UniformField())
    clamped_half = mesh.face_barycenters[:, 0] < LENGTH / 2
    magnetization = ms.magnetization_from_remanence(RESIDUAL_FLUX_DENSITY) * np.where(
        clamped_half[:, None], (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    )
    tip = mesh.nearest_vertex((LENGTH, WIDTH / 2, 0.0))
    return Strip(scene, magnetization, tip, DAMPING * 417 / mesh.n_vertices)


@dataclass(frozen=True)
class Task:
    """Be at the start of a curve at one step, at its end after the last, and on it in between."""

    curve: control.Curve
    steps: int
    first: int

    def squares(self, track) -> dict:
        """Compute the three terms of the objective [m2] for a track (steps + 1, 3) m."""
        return control.track_fitting(track, self.curve, self.first, self.steps, weights=WEIGHTS)


# Both curves lead from the one point to the other, around the corner and around the arc.
START, CORNER, END = (np.array((x, WIDTH / 2, z)) for x, z in ((24e-3, 4e-3), (24e-3, 12e-3), (16e-3, 12e-3)))
TASKS = {
    "L": Task(control.Polyline([START, CORNER, END]), steps=PAPER["L"]["steps"], first=67),
    "C": Task(
        control.Arc(START + END - CORNER, start=START, axis=(0, -1, 0), angle=np.pi / 2),
        steps=PAPER["C"]["steps"],
        first=40,
    ),
}
