"""A fish with a skeleton, and the water that it swims in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from magshell.mesh import generate as meshes
from magshell.mesh import shapes
from magshell.model.rigid.joints import Revolute
from magshell.model.rigid.link import Link
from magshell.model.rigid.skeleton import Skeleton
from magshell.model.scene.scene import Scene
from magshell.model.solids.materials import NeoHookean
from magshell.model.solids.solid import Solid
from robots.robot import Robot
from robots.water import water

if TYPE_CHECKING:
    import torch

TETRAHEDRA = 3268  # as [Qiao21]'s, of 0.22 x 0.09 x 0.40 m
YOUNG_MODULUS, POISSON_RATIO, MASS = 2e5, 0.4, 10.0  # Pa, 1, kg
TORQUES = (5.0, 3.5, 1.8, 2.5, 2.5)  # N m at most
DAMPING = (0.3, 0.2, 0.1, 0.12, 0.12)  # N m s/rad
STEPS, TIME_STEP = 100, 2e-2  # s
TARGET = (0.0, 0.0, 0.15)  # m, of the center of mass

_BONES = {  # m: from and to, and how near a vertex is to be
    "head": ((0, 0, 0.13), (0, 0, 0.175), 0.02),
    "front": ((0, 0, 0.05), (0, 0, 0.085), 0.02),
    "rear": ((0, 0, -0.045), (0, 0, 0.005), 0.02),
    "tail": ((0, 0, -0.18), (0, 0, -0.11), 0.018),
    "right fin": ((0.065, 0, 0.07), (0.095, 0, 0.07), 0.016),
    "left fin": ((-0.065, 0, 0.07), (-0.095, 0, 0.07), 0.016),
}
_JOINTS = (  # child, parent, where and about what: the spine bends sideways, the fins row
    ("front", "head", (0, 0, 0.108), (0, 1, 0)),
    ("rear", "front", (0, 0, 0.025), (0, 1, 0)),
    ("tail", "rear", (0, 0, -0.07), (0, 1, 0)),
    ("right fin", "front", (0.045, 0, 0.07), (0, 1, 0)),
    ("left fin", "front", (-0.045, 0, 0.07), (0, 1, 0)),
)


def body_shape() -> shapes.Shape:
    """Return the shape, nose towards z, back towards y: 0.40 m long, 0.09 m high, 0.22 m from fin to fin."""
    trunk = shapes.ellipsoid((0.035, 0.045, 0.13), center=(0, 0, 0.07))
    stem = shapes.capsule((0, 0, 0.0), (0, 0, -0.12), 0.03, 0.02)
    blade = shapes.box((0.024, 0.09, 0.09), center=(0, 0, -0.155), rounding=0.01)
    fins = [
        shapes.box((0.09, 0.088, 0.024), center=(side * 0.065, 0, 0.07), rounding=0.01) for side in (1, -1)
    ]
    return trunk.smooth_union(stem, blade, *fins, radius=0.012)


class Fish(Robot):
    """A soft fish with a skeleton, in water.

    scene: in water, without gravity. flesh: the Solid. joints: head to front, front to rear, rear to tail, right fin,
    left fin.
    """

    flesh: Solid
    traveller: Solid

    numbers: int = len(TORQUES)
    steps: int = STEPS
    time_step: float = TIME_STEP
    target: tuple[float, float, float] = TARGET
    stiffness_damping: float = 2e-3  # without it some torques make the motion jump

    def __init__(self, n_tetrahedra: int = TETRAHEDRA):
        mesh = meshes.from_distance(body_shape(), n_tetrahedra=n_tetrahedra)
        material = NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        density = MASS / mesh.volumes.sum()
        self.flesh = self.traveller = Solid(mesh, material=material, mass_density=density, element="linear")
        self.links: dict[str, Link] = {
            name: Link(self._near(*bone), body=self.flesh) for name, bone in _BONES.items()
        }
        self.joints: tuple[Revolute, ...] = tuple(
            Revolute(
                self.links[child], self.links[parent], origin=place, axis=axis, torque=0.0, damping=damping
            )
            for (child, parent, place, axis), damping in zip(_JOINTS, DAMPING, strict=True)
        )
        skeleton = Skeleton(list(self.links.values()), self.joints)
        self.scene: Scene = Scene([self.flesh, skeleton], water=water(), allow_rigid_motions=True)

    def _near(self, start, end, distance: float) -> np.ndarray:
        """Return the vertices near a segment."""
        points = self.flesh.mesh.rest_positions
        a, b = np.array(start, dtype=float), np.array(end, dtype=float)
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.flatnonzero(np.linalg.norm(points - a - share[:, None] * (b - a), axis=1) < distance)

    def values(self, controls: torch.Tensor | np.ndarray) -> dict[Any, Any]:
        """Return the values of the scene's objects for controls: torques over the largest."""
        return {
            joint: {"torque": most * controls[:, k]}
            for k, (joint, most) in enumerate(zip(self.joints, TORQUES, strict=True))
        }

    def first_controls(
        self, steps: int, amplitude: float = 0.5, frequency: float = 2.0, lag: float = 1.0
    ) -> np.ndarray:
        """Return controls to start a search from: a wave of `frequency` Hz along the spine, with the fins at rest.

        lag: rad, phase lag from joint to joint. Without any motion the gradient would be zero, because the water's
        force grows with the square of the speed.
        """
        phase = 2 * np.pi * frequency * TIME_STEP * np.arange(steps)
        spine = amplitude * np.sin(phase[:, None] - lag * np.arange(3))
        return np.concatenate([spine, np.zeros((steps, 2))], axis=1)
