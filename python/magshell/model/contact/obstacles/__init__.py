"""Bodies that sheets touch: planes and slopes, ground, round bodies, tubes, closed meshes; at rest or moving.

Each has a frame of its own, placed by `center` (3,) m and `rotation`, a rotation vector (3,) rad about the center, and
moved by `motion`, a function of the time. Contact is what a scene adds.
"""

from .ground import HeightField, bump
from .mesh_obstacle import MeshObstacle
from .obstacle import Obstacle
from .plane import Plane, slope
from .round_bodies import Box, Capsule, Sphere
from .tube import Tube

__all__ = [
    "Box",
    "Capsule",
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
