"""Obstacles that ride on rigid bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy

from ...._runtime.frozen import variant
from ...rigid.rigid import RigidBody
from . import _motion
from .obstacle import Obstacle, Surface

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


class Attached(Obstacle):
    """An obstacle attached to a rigid body or a link: it moves with the body, which feels the reaction of contact.

    Args:
        obstacle: one of ms.obstacles without a `motion`, in the world where the body is at rest.
        to: the RigidBody or Link. Vertices that belong to it cannot be in contact with the obstacle.
        center, rotation: at rest in the world, see Obstacle; by default those of `obstacle`. They cannot change in a motion.

    Contact and friction with it keep the momentum and the angular momentum of the bodies that touch. A sphere, a capsule, a
    box or an ellipsoid attached to the body of the same shape is the smooth surface of that body. It touches other obstacles
    as well: ms.Contact(obstacles, shapes=...). ms.ProjectiveDynamics does not take attached obstacles.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.02, 0.02, cells=(4, 4))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> ball = ms.RigidBody(mass=1e-3, inertia=1e-8, center=(0.01, 0.01, 6.1e-3), velocity=(0, 0, -0.1))
    >>> round_ball = ms.obstacles.Attached(ms.obstacles.Sphere(5e-3, center=(0.01, 0.01, 6.1e-3)), to=ball)
    >>> scene = ms.Scene([sheet, ball], contacts=[ms.Contact(round_ball, offset=5e-4)], allow_rigid_motions=True)
    >>> move = ms.simulate(scene, steps=20, time_step=1e-3)
    >>> bool(move[ball].velocity[-1, 2] > -0.1)
    True
    """

    _in_time = ()

    def __init__(
        self,
        obstacle: Obstacle,
        to: RigidBody,
        *,
        center: Numbers | None = None,
        rotation: Numbers | None = None,
    ) -> None:
        if not isinstance(obstacle, Obstacle) or isinstance(obstacle, Attached):
            raise ValueError(
                f"obstacle must be one of ms.obstacles that no body carries, got {obstacle!r:.60}"
            )
        if obstacle.motion is not None:
            raise ValueError(
                "the obstacle has a motion, but an attached obstacle moves with its rigid body only"
            )
        if not isinstance(to, RigidBody):
            raise ValueError(f"to must be a RigidBody or a Link, got {to!r:.60}")
        super().__init__(
            obstacle.center if center is None else center, obstacle.rotation if rotation is None else rotation
        )
        self.obstacle: Obstacle = obstacle
        self.to: RigidBody = to
        self._of(obstacle._core, obstacle=obstacle, to=to)

    def __getstate__(self) -> dict[Any, Any]:
        return {**self._made_from, "center": self.center, "rotation": self.rotation}

    def _positioned(self, pose: BodyPose) -> Obstacle:
        """Return the obstacle where the rigid body has moved it."""
        turned = scipy.spatial.transform.Rotation.from_matrix(pose.rotation @ _motion.matrix(self.rotation))
        return variant(
            self.obstacle,
            center=pose.center + pose.rotation @ (self.center - pose.rest_center),
            rotation=turned.as_rotvec(),
        )

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return self.obstacle._surface(extent, around)

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        return self.obstacle._middle

    def _summary(self) -> str:
        return f"{type(self.obstacle).__name__} to {self.to!r}"


class BodyPose(NamedTuple):
    """The pose of a rigid body: its center at rest and now, (3,) m, and its rotation matrix.

    The center is the mean of the four corners that stand for the body.
    """

    rest_center: np.ndarray
    center: np.ndarray
    rotation: np.ndarray
