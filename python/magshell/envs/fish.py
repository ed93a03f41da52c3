"""A fish with a skeleton, and the water that it swims in."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .. import meshes, shapes
from ..bodies.joints import Revolute
from ..bodies.link import Link
from ..bodies.materials import NeoHookean
from ..bodies.skeleton import Skeleton
from ..bodies.solid import Solid
from ..dynamics.simulate import simulate
from ..dynamics.trajectory import Trajectory
from ..methods.integrators import ImplicitEuler
from ..methods.solvers import MixedNewton
from ..scene.scene import Scene
from ..surroundings.water import Water

TETRAHEDRA = 3268  # as [Qiao21]'s, of 0.22 x 0.09 x 0.40 m
YOUNG_MODULUS, POISSON_RATIO, MASS = 2e5, 0.4, 10.0  # Pa, 1, kg
TORQUES = (5.0, 3.5, 1.8, 2.5, 2.5)  # N m at most
DAMPING = (0.3, 0.2, 0.1, 0.12, 0.12)  # N m s/rad
SOLVER = MixedNewton(tolerance=1e-4)
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
    """Nose towards z, back towards y: 0.40 m long, 0.09 m high, 0.22 m from fin to fin."""
    trunk = shapes.ellipsoid((0.035, 0.045, 0.13), center=(0, 0, 0.07))
    stem = shapes.capsule((0, 0, 0.0), (0, 0, -0.12), 0.03, 0.02)
    blade = shapes.box((0.024, 0.09, 0.09), center=(0, 0, -0.155), rounding=0.01)
    fins = [
        shapes.box((0.09, 0.088, 0.024), center=(side * 0.065, 0, 0.07), rounding=0.01) for side in (1, -1)
    ]
    return trunk.smooth_union(stem, blade, *fins, radius=0.012)


def water() -> Water:
    """As [Qiao21]'s: a drag of 1/2 rho A sin^2(phi) |u|^2 and a thrust by a table of the angle, on faces turned to the flow.

    Water here takes both sides of a face alike, so a closed body feels it in front and behind: half of it each. Of the
    table, kinked and of both signs, a smooth curve through zero at 0 and its values at 15, 50 and 90 degrees.
    """
    angles = np.radians((0.0, 15.0, 50.0, 90.0))
    thrust = (angles, np.array((0.0, 1.8, 1.15, 0.0)), np.array((8.0, 0.0)))
    return Water(fluid_density=1e3, drag_coefficient=0.25, thrust_coefficient=0.5, thrust_table=thrust)


class Fish:
    """scene: in water, without gravity. joints: head to front, front to rear, rear to tail, right fin, left fin."""

    def __init__(self, n_tetrahedra: int = TETRAHEDRA):
        mesh = meshes.from_distance(body_shape(), n_tetrahedra=n_tetrahedra)
        material = NeoHookean(young_modulus=YOUNG_MODULUS, poisson_ratio=POISSON_RATIO)
        density = MASS / mesh.volumes.sum()
        self.flesh = Solid(mesh, material=material, mass_density=density, element="linear")
        self.links = {name: Link(self._near(*bone), body=self.flesh) for name, bone in _BONES.items()}
        self.joints = tuple(
            Revolute(
                self.links[child], self.links[parent], origin=place, axis=axis, torque=0.0, damping=damping
            )
            for (child, parent, place, axis), damping in zip(_JOINTS, DAMPING, strict=True)
        )
        skeleton = Skeleton(list(self.links.values()), self.joints)
        self.scene = Scene([self.flesh, skeleton], water=water(), allow_rigid_motions=True)

    def _near(self, start, end, distance: float) -> np.ndarray:
        """Vertices that are near a segment."""
        points = self.flesh.mesh.rest_positions
        a, b = np.array(start, dtype=float), np.array(end, dtype=float)
        share = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        return np.flatnonzero(np.linalg.norm(points - a - share[:, None] * (b - a), axis=1) < distance)

    @cached_property
    def weights(self) -> np.ndarray:
        """(n_v,), the share of each vertex in the mass."""
        masses = self.flesh.vertex_masses
        return masses / masses.sum()

    def motion(self, controls, solver: MixedNewton = SOLVER) -> Trajectory:
        """From rest. controls: (steps, 5), torques over the largest, from -1 to 1; a tensor for gradients."""
        torques = {
            joint: {"torque": most * controls[:, k]}
            for k, (joint, most) in enumerate(zip(self.joints, TORQUES, strict=True))
        }
        return simulate(
            self.scene,
            steps=len(controls),
            time_step=TIME_STEP,
            values=torques,
            integrator=ImplicitEuler(),
            solver=solver,
            progress=False,
        )

    def way(self, motion: Trajectory):
        """(3,) m, of the center of mass until the end."""
        moved = motion.displacements[-1]
        weights = self.weights if isinstance(moved, np.ndarray) else moved.new_tensor(self.weights)
        return weights @ moved

    def miss(self, motion: Trajectory, target=TARGET):
        """How far from the target, (3,) m, the center of mass ends, over the way there."""
        goal = np.array(target, dtype=float)
        way = self.way(motion)
        away = way - (goal if isinstance(way, np.ndarray) else way.new_tensor(goal))
        return (away**2).sum() ** 0.5 / float(np.linalg.norm(goal))
