"""A gripper of pneumatic cells under a drone, and the ball that it carries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from magshell.mesh import generate as meshes
from magshell.mesh.tetrahedra.tet_mesh import TetMesh
from magshell.model.actuators.cells import PneumaticCells
from magshell.model.contact import obstacles
from magshell.model.contact.body_contact import BodyContact
from magshell.model.contact.contact import Contact
from magshell.model.scene.scene import Scene
from magshell.model.solids.materials import NeoHookean
from magshell.model.solids.solid import Solid
from magshell.model.supports.supports import Pin
from robots.robot import Robot

if TYPE_CHECKING:
    import torch

CUBE = 0.085  # m: of these it is built; with the ball 1.1 x 1.6 x 1.1 m, [Qiao21]'s is 1.1 x 1.5 x 1.1
LEVELS = 14  # of an arm, a cell in each: 56 in all
WIDE, ACROSS = 3, 13  # cubes: an arm, and the whole
LOW, RADIUS = 0.0, 0.37  # m: arms end as high as the middle of the ball, so that friction has to hold it
BALL_CELLS = 3
YOUNG_MODULUS, POISSON_RATIO, MASS, BALL_MASS = 2e5, 0.4, 10.0, 1.0  # Pa, 1, kg, kg
STIFFNESS, INFLATED = 5e5, 1.6  # Pa, of a cell; its volume over that at rest, at most
RESPONSE = 0.2  # fraction of the difference between requested and present volume that a step makes up: air flows slowly
FRICTION = 0.8
SPEED = 1.5  # m/s, of the drone along an axis, at most
STEPS, TIME_STEP = 50, 1e-2  # s
TARGET = (0.0, 0.3, 0.0)  # m, of the ball


class CellGripper(Robot):
    """Four arms of pneumatic cells under a drone, and a ball on a table.

    levels: of an arm, with a cell in each; the ball needs 5. ball_cells: of its mesh, from its center to its surface.

    scene: arms and ball, gravity, and a table that the ball lies on. arms, ball: the Solids. cells: 56, from the lowest
    of an arm to the highest, arm by arm. drone: the Pin that holds the arms' upper end, and moves.
    ends: (4, n), the vertices at the end of each arm.

    A step has 59 numbers: the requested volumes of the cells, from 1 to INFLATED, whose difference from the present
    ones
    decreases by the fraction RESPONSE in a step, and the speed of the drone along three axes, up to SPEED.
    """

    arms: Solid
    ball: Solid

    numbers: int = 4 * LEVELS + 3
    steps: int = STEPS
    time_step: float = TIME_STEP
    target: tuple[float, float, float] = TARGET
    keep: str = "factors"  # of 50 steps

    def __init__(
        self, levels: int = LEVELS, ball_cells: int = BALL_CELLS, friction_coefficient: float = FRICTION
    ):
        mesh, groups = gripper_mesh(levels)
        self.numbers: int = 4 * levels + 3
        material = NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        round_mesh = meshes.ball(RADIUS, cells=ball_cells)
        self.arms, self.ball = (
            Solid(each, material=material, mass_density=mass / each.volumes.sum(), element="linear")
            for each, mass in ((mesh, MASS), (round_mesh, BALL_MASS))
        )
        self.traveller: Solid = self.ball
        self.cells: PneumaticCells = PneumaticCells(self.arms, groups, stiffness=STIFFNESS)
        top = mesh.rest_positions[:, 1].max()
        plate = mesh.vertices_where(lambda x: x[:, 1] > top - 1e-6)
        self.drone: Pin = Pin(plate, displacement=(0, 0, 0), body=self.arms)
        tips = mesh.vertices_where(lambda x: x[:, 1] < LOW + 1e-6)
        side = np.argmax(mesh.rest_positions[tips] @ [(-1, 1, 0, 0), (0, 0, 0, 0), (0, 0, -1, 1)], axis=1)
        self.ends: np.ndarray = np.array([tips[side == k] for k in range(4)])
        table = obstacles.Plane(center=(0, -RADIUS, 0), normal=(0, 1, 0))
        self.grip: BodyContact = BodyContact(self.arms, self.ball, friction_coefficient=friction_coefficient)
        self.scene: Scene = Scene(
            [self.arms, self.ball],
            supports=[self.drone],
            actuators=[self.cells],
            contacts=[self.grip, Contact(table, body=self.ball, friction_coefficient=friction_coefficient)],
            gravity=(0, -9.81, 0),
            allow_rigid_motions=True,
        )

    def values(self, controls: torch.Tensor | np.ndarray) -> dict[Any, Any]:
        """Return the values of the scene's objects for controls (steps, 59)."""
        ago = np.subtract.outer(np.arange(len(controls)), np.arange(len(controls)))
        filling = np.where(ago >= 0, RESPONSE * (1.0 - RESPONSE) ** np.maximum(ago, 0), 0.0)
        moving = SPEED * TIME_STEP * np.tri(len(controls) + 1, len(controls), -1)
        if not isinstance(controls, np.ndarray):
            filling, moving = map(controls.new_tensor, (filling, moving))
        ratios = 1.0 + 0.5 * (INFLATED - 1.0) * (filling @ (controls[:, :-3] + 1.0))
        return {self.cells: {"volume_ratio": ratios}, self.drone: {"displacement": moving @ controls[:, -3:]}}

    @staticmethod
    def filled(numbers: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return the volumes of the cells after a step, over those at rest, for the requested ones."""
        return before + RESPONSE * (1.0 + 0.5 * (INFLATED - 1.0) * (numbers + 1.0) - before)

    def first_controls(
        self, steps: int, inflated: float = 0.5, closed: int = 10, speed: float = 0.2
    ) -> np.ndarray:
        """Return controls to start a search from.

        All cells are inflated to the same fraction of the largest volume; after `closed` steps the drone rises at a
        fraction of SPEED, which is not far enough.
        """
        step = np.arange(steps)
        controls = np.zeros((steps, self.numbers))
        controls[:, :-3] = -1.0 + 2.0 * inflated
        controls[:, -2] = speed * np.clip((step - closed) / 8, 0, 1)
        return controls


def gripper_mesh(levels: int = LEVELS) -> tuple[TetMesh, np.ndarray]:
    """Build four arms that hang from a cross, of cubes: two thick and three wide.

    Also returns the pneumatic cell of each tetrahedron, (n_t,), -1 for none: the outer half of an arm, level by level.
    """
    block = meshes.box(CUBE * np.array([ACROSS, levels + 1, ACROSS]), cells=(ACROSS, levels + 1, ACROSS))
    i, level, k = np.floor(block.tetrahedron_barycenters / CUBE).astype(int).T
    x, z = np.abs(i - ACROSS // 2), np.abs(k - ACROSS // 2)
    far, near = np.maximum(x, z), np.minimum(x, z)
    beam = near <= WIDE // 2
    hanging, outer = beam & (far >= ACROSS // 2 - 1), far == ACROSS // 2
    kept = np.where(level < levels, hanging, beam)
    arm = np.select([i == 0, i == ACROSS - 1, k == 0], [0, 1, 2], 3)
    groups = np.where(hanging & outer & (level < levels), arm * levels + level, -1)
    nodes = block.tetrahedra[kept]
    used, numbers = np.unique(nodes, return_inverse=True)
    corner = np.array([-0.5 * CUBE * ACROSS, LOW, -0.5 * CUBE * ACROSS])
    return TetMesh(block.rest_positions[used] + corner, numbers.reshape(-1, 4)), groups[kept]
