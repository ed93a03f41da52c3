"""Obstacles with a plane surface: floors, walls and slopes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.quantity import quantity
from ._surfaces import grid_faces
from .obstacle import Obstacle, Surface

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


# Cells along each side of the square that represents a plane in pictures. Small triangles are sorted better by their depth.
CELLS = 16


class Plane(Obstacle):
    """A solid half-space bounded by a plane; bodies are kept on the side to which the normal points.

    Args:
        normal: (3,), of any length but zero, in the obstacle's own frame.
        center: (3,) m, a point of the plane.
        rotation, motion: see Obstacle.

    >>> Plane(center=(0, 0, -0.01)).signed_distance([1, 2, 0]).round(6).item()
    0.01
    """

    def __init__(
        self,
        normal: Numbers = (0.0, 0.0, 1.0),
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        given = quantity("normal", "1", normal, (3,))
        largest = np.abs(given).max()
        if largest == 0:
            raise ValueError("normal must not be zero")
        self.normal: Any = given / largest / np.linalg.norm(given / largest)
        self._of(core.Obstacle.plane(self.normal), normal=self.normal)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        axis = np.eye(3)[np.argmin(np.abs(self.normal))]
        first = np.cross(axis, self.normal)
        first /= np.linalg.norm(first)
        second = np.cross(self.normal, first)
        coordinates = extent * np.linspace(-0.5, 0.5, CELLS + 1)
        u, v = np.meshgrid(coordinates, coordinates, indexing="ij")
        middle = around - (around @ self.normal) * self.normal
        vertices = middle + u.reshape(-1, 1) * first + v.reshape(-1, 1) * second
        return vertices, grid_faces(CELLS + 1, CELLS + 1)

    def _summary(self) -> str:
        return f"normal ({', '.join(f'{x:.4g}' for x in self.normal + 0.0)})"


def slope(
    angle: float,
    uphill: Numbers = (1.0, 0.0),
    *,
    center: Numbers = (0.0, 0.0, 0.0),
    rotation: Numbers = (0.0, 0.0, 0.0),
    motion: Callable[..., Any] | None = None,
) -> Plane:
    """Make an inclined Plane, with z as the vertical axis.

    Args:
        angle: rad between the plane and the horizontal, between -pi/2 and pi/2.
        uphill: (2,), the horizontal direction (x, y) in which a plane with a positive angle rises.
        center: (3,) m, a point of the plane.
        rotation, motion: see Obstacle.

    >>> slope(0.1)
    Plane(normal (-0.09983, 0, 0.995))
    """
    angle = float(quantity("angle", "rad", angle, ()))
    if not abs(angle) < np.pi / 2:
        raise ValueError(f"angle [rad] must lie between -pi/2 and pi/2, got {angle:g}")
    ahead = quantity("uphill", "1", uphill, (2,))
    if not ahead.any():
        raise ValueError("uphill must not be zero")
    x, y = ahead / np.linalg.norm(ahead)
    normal = (-np.sin(angle) * x, -np.sin(angle) * y, np.cos(angle))
    return Plane(normal, center=center, rotation=rotation, motion=motion)
