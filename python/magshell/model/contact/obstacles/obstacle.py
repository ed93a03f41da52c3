"""The base class of obstacles: their pose, their motion, and their distance from points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.owner import Owner
from ...._input.quantity import quantity
from ...._runtime.frozen import variant
from . import _motion

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


Surface = tuple[np.ndarray, np.ndarray]
NO_MIDDLE = np.zeros((0, 3)), np.inf  # of a body that is open, or that surrounds the sheet


class Obstacle(Owner, ABC):
    """A rigid body with which a scene's bodies can be in contact; the base class of obstacles.

    A point x of the world is R^T (x - center) in the body's own frame, R = exp(rotation). At a time t the motion moves
    the center by its displacement, and rotates the body further about it.

    Args:
        center: (3,) m.
        rotation: rotation vector (3,) rad, about the center.
        motion: None, or a function of the time [s] that returns a displacement (3,) m, or (displacement (3,) m,
            rotation vector (3,) rad), in world axes. It must be smooth: its derivatives are computed from its values within
            2e-4 s before and after a time (4e-4 s after it at the start, never before time 0). For gradients with
            respect to the path, give center and rotation over time among the values of ms.simulate instead.

    `_core` is the shape in the C++ core; `_made_from` has the arguments from which a copy or another process makes it.
    """

    _core: core.Obstacle
    _replaceable = _in_time = ("center", "rotation")
    _made_from: dict[str, Any]

    def __init__(
        self,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        self.center: np.ndarray = quantity("center", "m", center, (3,))
        self.rotation: np.ndarray = quantity("rotation", "rad", rotation, (3,))
        if motion is not None and not callable(motion):
            raise ValueError(
                f"motion must be None or a function of the time [s], got {type(motion).__name__}"
            )
        self.motion = motion
        self.pose(0.0)

    def _of(self, shape: core.Obstacle, **arguments) -> None:
        """Store the shape and the arguments that it was made from."""
        self._core = shape
        self._made_from = arguments

    def __getstate__(self) -> dict[Any, Any]:
        return {
            **self._made_from,
            "center": self.center,
            "rotation": self.rotation,
            "motion": self.motion,
        }

    def __setstate__(self, arguments: dict[Any, Any]) -> None:
        self.__init__(**arguments)

    def replaced(self, **values: Any) -> Obstacle:
        """Return the same body with another center or rotation."""
        unknown = sorted(set(values) - set(self._replaceable))
        if unknown:
            raise ValueError(f"of an obstacle center and rotation can be replaced, not {', '.join(unknown)}")
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        Obstacle.__init__(
            other, **{"center": self.center, "rotation": self.rotation, **values}, motion=self.motion
        )
        return other

    def _on(self, path: Callable[..., Any]) -> Obstacle:
        """Return the same body on a path, a function that gives its center and rotation at a time."""
        return variant(self, center=np.zeros(3), rotation=np.zeros(3), motion=path)

    def pose(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the motion at a time [s]: displacement (3,) m, and rotation vector (3,) rad about the center."""
        return _motion.pose(self.motion, time)

    def rates(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the velocity (3,) m/s of the center and the angular velocity omega (3,) rad/s at a time [s].

        omega is in world axes, dR/dt = [omega] R. Both are fourth-order differences with steps of 1e-4 s: for a motion
        with the angular frequency w their relative error is (w 1e-4 s)^4 / 30, which is 3e-8 at 50 Hz.
        """
        return _motion.rates(self.motion, time)

    def signed_distance(self, points: Numbers, time: float = 0.0) -> np.ndarray:
        """Return the distances of points (..., 3) m from the body at a time [s], (...) m, negative inside.

        >>> from magshell.obstacles import Sphere
        >>> float(Sphere(radius=0.5, center=(0, 0, 1)).signed_distance([0, 0, 3]))
        1.5
        """
        return self._distances(points, time)[0]

    def normals(self, points: Numbers, time: float = 0.0) -> np.ndarray:
        """Return unit vectors that point away from the body at points (..., 3) m, (..., 3): the gradient of the
        distance.
        """
        return self._distances(points, time)[1] @ self._frame(time)[0].T

    def surface(self, time: float = 0.0, extent: float = 1.0, around: Numbers | None = None) -> Surface:
        """Return a triangle mesh for pictures: vertices (n, 3) m in world coordinates, faces (m, 3).

        extent: m, the side of the square that stands for a plane. around: (3,) m, the point that the square is nearest
        to; by default the center.
        """
        rotation, origin = self._frame(time)
        middle = origin if around is None else quantity("around", "m", around, (3,))
        side = float(quantity("extent", "m", extent, ()))
        vertices, faces = self._surface(side, (middle - origin) @ rotation)
        return vertices @ rotation.T + origin, faces

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        """Return points on the middle of a closed body, (k, 3) m in its own frame, and its smallest radius there, m."""
        return NO_MIDDLE

    @abstractmethod
    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        """Return the mesh of `surface` in the body's own frame."""

    def _frame(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the rotation matrix (3, 3) and the origin (3,) m of the body's own frame at a time [s]."""
        displacement, rotation = self.pose(time)
        return _motion.matrix(rotation) @ _motion.matrix(self.rotation), self.center + displacement

    def _distances(self, points, time: float) -> tuple[np.ndarray, np.ndarray]:
        points = quantity("points", "m", points, ("...", 3))
        rotation, origin = self._frame(time)
        values, normals, _ = core.distances(self._core, (points.reshape(-1, 3) - origin) @ rotation)
        return values.reshape(points.shape[:-1]), normals.reshape(points.shape)

    def __repr__(self) -> str:
        parts = [self._summary()]
        if self.center.any():
            parts.append(f"center ({', '.join(f'{x:g}' for x in self.center)}) m")
        if self.rotation.any():
            parts.append(f"rotation ({', '.join(f'{x:g}' for x in self.rotation)}) rad")
        if self.motion is not None:
            parts.append("moving")
        return f"{type(self).__name__}({', '.join(parts)})"

    @abstractmethod
    def _summary(self) -> str:
        """Return the shape in a few words."""


def points_between(first: np.ndarray, last: np.ndarray, spacing: float) -> np.ndarray:
    """Return points (k, 3) m on a straight line with its ends, at most `spacing` [m] apart."""
    parts = int(np.ceil(np.linalg.norm(last - first) / spacing))
    return np.linspace(first, last, parts + 1)
