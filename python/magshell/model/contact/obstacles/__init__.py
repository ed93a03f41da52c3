"""Obstacles: planes and slopes, ground, round bodies, tubes, closed meshes; at rest or moving.

Each has a frame of its own with the origin `center` (3,) m and the orientation `rotation`, a rotation vector (3,) rad
about the center; `motion`, a function of the time, moves it, or it is attached to a rigid body (`Attached`). A Contact lets
it act on a scene's bodies.
"""

from .attached import Attached
from .ground import HeightField, bump
from .mesh_obstacle import MeshObstacle
from .obstacle import Obstacle
from .plane import Plane, slope
from .round_bodies import Box, Capsule, Ellipsoid, Sphere
from .tube import Tube

__all__ = [
    "Attached",
    "Box",
    "Capsule",
    "Ellipsoid",
    "HeightField",
    "MeshObstacle",
    "Obstacle",
    "Plane",
    "Sphere",
    "Tube",
    "bump",
    "slope",
]


def __dir__() -> list[str]:
    """Returns what is public, for tab completion."""
    return sorted(__all__)
