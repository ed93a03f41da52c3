"""A sheet of four arms above a ball: the scene for the design in equilibrium, and that of the lift in time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import magshell as ms

RADIUS, HALF_WIDTH, ARM, THICKNESS = 6e-3, 3e-3, 12e-3, 5e-4  # m, of the ball and of the sheet
LIMIT, FIELD = 60e3, (0.0, 0.0, -40e-3)  # A/m, a component; T
FRICTION = 0.6
GRAVITY = (0.0, 0.0, -9.81)


def cross(cell: float) -> ms.TriangleMesh:
    """Build the mesh of four arms around a square; cell: edge length, m."""
    reach = HALF_WIDTH + ARM
    cells = 2 * round(reach / cell)
    square = ms.meshes.rectangle(2 * reach, 2 * reach, cells=(cells, cells))
    centered = square.transformed(translation=(-reach, -reach, 0.0))
    faces = centered.faces[np.abs(centered.face_barycenters[:, :2]).min(axis=1) < HALF_WIDTH]
    used, numbers = np.unique(faces, return_inverse=True)
    return ms.TriangleMesh(centered.rest_positions[used], numbers.reshape(-1, 3))


@dataclass
class Gripper:
    """The gripper and its ball. cell: m, of the sheet. ball_cells: along an edge of the ball's icosahedron."""

    cell: float = 1.5e-3
    ball_cells: int = 2

    def __post_init__(self):
        self.mesh = cross(self.cell)
        self.sheet = ms.Shell(
            self.mesh, thickness=THICKNESS, young_modulus=5e5, poisson_ratio=0.45, mass_density=2e3
        )
        center = (0.0, 0.0, -RADIUS - THICKNESS)
        self.ball = ms.Solid(
            ms.meshes.ball(RADIUS, cells=self.ball_cells).transformed(translation=center),
            material=ms.NeoHookean(young_modulus=3e5, poisson_ratio=0.4),
            mass_density=5e2,
            element="linear",
        )
        self.held_edges = self.mesh.edges_where(lambda x: np.abs(x[:, :2]).max(axis=1) < 0.6 * HALF_WIDTH)

    @cached_property
    def outwards(self) -> np.ndarray:
        """The unit vectors along the arms, (n_f, 3); zero in the middle."""
        x = self.mesh.face_barycenters
        along_x = np.abs(x[:, :1]) > np.abs(x[:, 1:2])
        out = np.where(along_x, np.sign(x) * [1, 0, 0], np.sign(x) * [0, 1, 0])
        return out * (np.abs(x[:, :2]).max(axis=1) > HALF_WIDTH)[:, None]

    @cached_property
    def wrapped(self) -> np.ndarray:
        """The target of the design: positions (n_v, 3) m at which the arms follow the ball along their whole length."""
        x = self.mesh.rest_positions
        along_x = np.abs(x[:, :1]) > np.abs(x[:, 1:2])
        radius = RADIUS + 0.6 * THICKNESS
        along = np.where(along_x, x[:, :1], x[:, 1:2])
        around = np.abs(along) / radius
        out, down = np.sign(along) * radius * np.sin(around), radius * (np.cos(around) - 1)
        return np.hstack([np.where(along_x, out, x[:, :1]), np.where(along_x, x[:, 1:2], out), down])

    @cached_property
    def closing(self) -> ms.Scene:
        """The scene of the design: the ball stands on its lowest vertices, without friction, which does no work in
        an equilibrium.
        """
        standing = self.ball.mesh.vertices_where(lambda x: x[:, 2] < -THICKNESS - 1.7 * RADIUS)
        return ms.Scene(
            [self.sheet, self.ball],
            supports=[ms.Clamp(self.held_edges, body=self.sheet), ms.Pin(standing, body=self.ball)],
            contacts=[ms.Contact(self.sheet, self.ball), ms.SelfContact(self.sheet)],
            field=ms.UniformField(),
            gravity=GRAVITY,
        )

    @cached_property
    def lifting(self) -> ms.Scene:
        """The scene of the lift: the ball is free, on a table, and the middle of the sheet moves up by 20 mm."""
        moved = ms.Clamp(self.held_edges, displacement=(0, 0, 20e-3), body=self.sheet)
        table = ms.obstacles.Plane(center=(0, 0, -THICKNESS - 2 * RADIUS))
        return ms.Scene(
            [self.sheet, self.ball],
            supports=[moved],
            contacts=[
                ms.Contact(self.sheet, self.ball, friction_coefficient=FRICTION),
                ms.Contact(table, body=self.ball, friction_coefficient=FRICTION),
                ms.SelfContact(self.sheet, friction_coefficient=FRICTION),
            ],
            field=ms.UniformField(),
            gravity=GRAVITY,
            allow_rigid_motions=True,
        )
