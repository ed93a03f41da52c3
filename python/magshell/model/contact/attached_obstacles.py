"""Places obstacles that rigid bodies carry where these bodies are."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..rigid.rigid import RigidBody
from .obstacles.attached import Attached, BodyPose

if TYPE_CHECKING:
    from ..scene.scene import Scene
    from .obstacles.obstacle import Obstacle

_CORNERS, _POINTS = 4, 10  # of each rigid body: the corners are the first of its points


class MovingObstacle(NamedTuple):
    """An attached obstacle as it is in one state, with the velocity (3,) m/s of its center and its angular velocity."""

    obstacle: Obstacle
    velocity: np.ndarray
    spin: np.ndarray


def bodies_of_attached(scene: Scene) -> list[int]:
    """Return the number of the rigid body that carries each obstacle, -1 for none. Raises ValueError for one that is not in
    the scene."""
    numbers = []
    for obstacle in scene.obstacles:
        if not isinstance(obstacle, Attached):
            numbers.append(-1)
            continue
        if not any(obstacle.to is part for part in scene.rigid_parts):
            raise ValueError(f"{obstacle!r:.80}: the rigid body that carries it is not in the scene")
        numbers.append(scene._bodies.rigid_number(obstacle.to))
    return numbers


def positioned(scene: Scene, obstacle: Obstacle, own_points: np.ndarray | None) -> Obstacle:
    """Return an obstacle as it is in a state: an attached one where its rigid body is, any other as it is given.

    own_points: the points of the rigid bodies, (10 each, 3) m; None at rest.
    """
    if not isinstance(obstacle, Attached) or own_points is None:
        return obstacle
    return obstacle._positioned(_pose(scene, obstacle.to, own_points)[0])


def positioned_in_motion(
    scene: Scene, obstacle: Attached, own_points: np.ndarray, own_velocities: np.ndarray
) -> MovingObstacle:
    """Return an attached obstacle in a state, with its velocities.

    own_points, own_velocities: of the points of the rigid bodies, (10 each, 3) m and m/s.
    """
    pose, rows = _pose(scene, obstacle.to, own_points)
    now, arms, rates = obstacle._positioned(pose), own_points[rows] - pose.center, own_velocities[rows]
    # The four corners make a regular tetrahedron, with the same moment of inertia about every axis.
    spin = np.cross(arms, rates).sum(axis=0) * 1.5 / np.square(arms).sum()
    return MovingObstacle(now, rates.mean(axis=0) + np.cross(spin, now.center - pose.center), spin)


def _pose(scene: Scene, part: RigidBody, own_points: np.ndarray) -> tuple[BodyPose, slice]:
    """Return the pose of a rigid body, and the rows of its corners among the points of all."""
    number = scene._bodies.rigid_number(part)
    rows = slice(_POINTS * number, _POINTS * number + _CORNERS)
    corners, rest = own_points[rows], scene._rigid[number].rest[:_CORNERS]
    center, rest_center = corners.mean(axis=0), rest.mean(axis=0)
    arms = rest - rest_center
    rotation = (corners - center).T @ arms * 3.0 / np.square(arms).sum()
    return BodyPose(rest_center, center, rotation), rows
