"""The scene of [Qiao21] Figure 2: a soft ball above a sheet held at its four corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import magshell as ms

RADIUS, BALL_MASS = 0.3, 10.0  # m, kg
SIDE, SHEET_MASS, BENDING = 1.0, 3.0, 5e-4  # m, kg/m2, N m
POISSON = 0.3  # of the sheet; the ball has 0.4
GRAVITY = 9.8
HELD = 1 / 8  # m: a cell of the coarsest sheet at each corner
PAPER_STRETCH, STRETCH = 200.0, 2e4  # N/m
TIME_STEP = 5e-3


@dataclass(frozen=True)
class Throw:
    """A throw of the ball: its start relative to the middle of the sheet [m], and its velocity [m/s]."""

    aside: tuple[float, float]
    velocity: tuple[float, float, float]


THROWS = (
    Throw((0.02, -0.01), (0.0, 0.0, -3.0)),
    Throw((0.10, 0.05), (0.0, 0.0, -1.0)),
    Throw((-0.20, 0.10), (1.0, -0.5, -3.0)),
    Throw((0.05, -0.15), (0.0, 1.5, -2.0)),
    Throw((-0.10, -0.10), (0.5, 0.5, -4.0)),
)


def ball_mesh(cells: int) -> ms.TetMesh:
    """Return the mesh of the ball.

    cells: 2 for the paper's ball, whose tetrahedra all meet in the middle, or more.
    """
    mesh = ms.meshes.ball(RADIUS, cells=cells)
    if cells > 2:
        return mesh
    surface = mesh.surface
    points = np.vstack([surface.rest_positions, np.zeros(3)])
    middle = np.full(surface.n_faces, surface.n_vertices)
    return ms.TetMesh(points, np.column_stack([surface.faces[:, ::-1], middle]))


@dataclass(frozen=True)
class Scenery:
    """A ball, a sheet, and their contact."""

    ball: ms.Solid
    sheet: ms.Shell
    touch: ms.Contact
    scene: ms.Scene

    def thrown(self, throw: Throw, steps: int, **options) -> ms.Trajectory:
        velocities = np.zeros((self.scene.mesh.n_vertices, 3))
        velocities[: self.ball.mesh.n_vertices] = throw.velocity
        return ms.simulate(
            self.scene,
            steps=steps,
            time_step=TIME_STEP,
            velocities=velocities,
            integrator=ms.ImplicitEuler(),  # as in the paper's code
            progress=False,
            **options,
        )


def scenery(throw: Throw, cells: int, ball_cells: int = 2, stretch: float = STRETCH) -> Scenery:
    """Build the scene of one throw.

    cells: of the sheet, along a side; ball_cells: as in ball_mesh. stretch: membrane stiffness of the sheet, N/m.
    Thickness and modulus of the sheet are computed from its stiffnesses in the plane and in bending.
    """
    thickness = np.sqrt(12 * (1 - POISSON**2) * BENDING / stretch)
    sheet_mesh = ms.meshes.rectangle(SIDE, SIDE, cells=(cells, cells))
    sheet = ms.Shell(
        sheet_mesh,
        thickness=thickness,
        young_modulus=stretch / thickness,
        poisson_ratio=POISSON,
        mass_density=SHEET_MASS / thickness,
        bending="hinge",
    )
    middle = (0.5 * SIDE + throw.aside[0], 0.5 * SIDE + throw.aside[1], RADIUS + 2 * thickness)
    mesh = ball_mesh(ball_cells).transformed(translation=middle)
    ball = ms.Solid(
        mesh,
        material=ms.NeoHookean(young_modulus=1e4, poisson_ratio=0.4),
        mass_density=BALL_MASS / mesh.volume,
        element="linear",
    )
    corners = sheet_mesh.vertices_where(
        lambda x: np.abs(x[:, :2] - 0.5 * SIDE).min(axis=1) > (0.5 - 1.01 * HELD) * SIDE
    )
    touch = ms.Contact(ball, sheet)
    scene = ms.Scene(
        [ball, sheet],
        supports=[ms.Pin(corners, body=sheet)],
        contacts=[touch],
        gravity=(0, 0, -GRAVITY),
        allow_rigid_motions=True,
    )
    return Scenery(ball, sheet, touch, scene)
