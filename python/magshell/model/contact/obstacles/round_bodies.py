"""Spheres, ellipsoids, boxes and capsules: solid bodies, or hollow ones with the sheet inside."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.quantity import quantity, shape_of
from ...._input.scalars import all_positive, flag, positive
from ._surfaces import box_surface, sphere_surface, swept_surface
from .obstacle import NO_MIDDLE, Obstacle, Surface, points_between

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


class Sphere(Obstacle):
    """A ball around the center.

    Args:
        radius: m.
        inside: True if the bodies of the scene are inside of it, a hollow.
        center, rotation, motion: see Obstacle.

    >>> Sphere(0.02, inside=True).signed_distance([0, 0, 0]).item()
    0.02
    """

    def __init__(
        self,
        radius: float,
        inside: bool = False,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        self.radius: float = positive("radius", "m", radius)
        self.inside: bool = flag("inside", inside)
        self._of(_sided(core.Obstacle.sphere(self.radius), inside), radius=self.radius, inside=inside)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return sphere_surface(self.radius)

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        return NO_MIDDLE if self.inside else (np.zeros((1, 3)), self.radius)

    def _summary(self) -> str:
        return f"radius {self.radius:g} m{_side(self.inside)}"


class Ellipsoid(Obstacle):
    """An ellipsoid around the center.

    Args:
        semi_axes: (3,) m, along the axes of its own frame.
        inside: True if the bodies of the scene are inside of it, a hollow.
        center, rotation, motion: see Obstacle.

    >>> Ellipsoid((0.3, 0.2, 0.1)).signed_distance([0, 0, 0.15]).round(12).item()
    0.05
    """

    def __init__(
        self,
        semi_axes: Numbers,
        inside: bool = False,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        self.semi_axes: np.ndarray = all_positive("semi_axes", "m", semi_axes, (3,))
        self.inside: bool = flag("inside", inside)
        shape = core.Obstacle.ellipsoid(self.semi_axes)
        self._of(_sided(shape, inside), semi_axes=self.semi_axes, inside=inside)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        vertices, faces = sphere_surface(1.0)
        return vertices * self.semi_axes, faces

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        if self.inside:
            return NO_MIDDLE
        radius, along = float(self.semi_axes.min()), int(np.argmax(self.semi_axes))
        end = (float(self.semi_axes[along]) - radius) * np.eye(3)[along]
        return points_between(-end, end, radius), radius

    def _summary(self) -> str:
        return f"semi-axes {' x '.join(f'{x:g}' for x in self.semi_axes)} m{_side(self.inside)}"


class Box(Obstacle):
    """A box around the center, its sides along the axes of its own frame.

    With sharp edges the distance of points outside is once continuously differentiable; for points inside, the
    normals jump where two sides are equally near, as in every convex body.

    Args:
        size: (3,) m, the lengths of its sides.
        rounding: m, the radius of its edges and corners, at most half the shortest side.
        inside: True if the bodies of the scene are inside of it, a hollow.
        center, rotation, motion: see Obstacle.

    >>> Box((1, 1, 1)).signed_distance([2, 0, 0]).item()
    1.5
    """

    def __init__(
        self,
        size: Numbers,
        rounding: float = 0.0,
        inside: bool = False,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        self.size: np.ndarray = all_positive("size", "m", size, (3,))
        self.rounding: float = float(quantity("rounding", "m", rounding, ()))
        if not 0 <= self.rounding <= self.size.min() / 2:
            raise ValueError(
                f"rounding [m] must lie between 0 and half the shortest side, {self.size.min() / 2:g}, "
                f"got {self.rounding:g}"
            )
        self.inside: bool = flag("inside", inside)
        shape = core.Obstacle.box(self.size / 2, self.rounding)
        self._of(_sided(shape, inside), size=self.size, rounding=self.rounding, inside=inside)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return box_surface(self.size, self.rounding)

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        if self.inside:
            return NO_MIDDLE
        _, across, along = np.argsort(self.size, kind="stable")
        radius = float(self.size[across]) / 2
        end = (float(self.size[along]) / 2 - radius) * np.eye(3)[along]
        return points_between(-end, end, radius), radius

    def _summary(self) -> str:
        rounded = f", edges rounded by {self.rounding:g} m" if self.rounding else ""
        return f"{' x '.join(f'{x:g}' for x in self.size)} m{rounded}{_side(self.inside)}"


class Capsule(Obstacle):
    """A cylinder with half a ball at both ends.

    Args:
        ends: (2, 3) m, of the segment along which the ball is swept, in the body's own frame; or the length [m] of a
            segment along x around the center.
        radius: m.
        inside: True if the bodies of the scene are inside of it, a hollow.
        center, rotation, motion: see Obstacle.

    >>> Capsule(0.1, radius=0.02)
    Capsule(length 0.1 m, radius 0.02 m)
    """

    def __init__(
        self,
        ends: Numbers,
        radius: float,
        inside: bool = False,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        if shape_of("ends [m]", ends) == ():
            half = positive("ends", "m", ends) / 2
            ends = [[-half, 0, 0], [half, 0, 0]]
        self.ends: np.ndarray = quantity("ends", "m", ends, (2, 3))
        self.radius: float = positive("radius", "m", radius)
        self.length: float = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        if self.length <= 1e-12 * self.radius:
            raise ValueError("ends [m] must be two different points; Sphere is a capsule without a length")
        self.inside: bool = flag("inside", inside)
        shape = core.Obstacle.capsule(self.ends[0], self.ends[1], self.radius)
        self._of(_sided(shape, inside), ends=self.ends, radius=self.radius, inside=inside)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return swept_surface(self.ends, np.full(2, self.radius), closed=True)

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        return NO_MIDDLE if self.inside else (points_between(*self.ends, self.radius), self.radius)

    def _summary(self) -> str:
        return f"length {self.length:g} m, radius {self.radius:g} m{_side(self.inside)}"


def _sided(shape: core.Obstacle, inside: bool) -> core.Obstacle:
    return shape.inverted() if inside else shape


def _side(inside: bool) -> str:
    return ", bodies inside" if inside else ""
