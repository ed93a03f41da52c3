"""Pipes, tunnels and horns."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.quantity import quantity, shape_of
from ...._input.scalars import all_positive, flag
from ._surfaces import swept_surface
from .obstacle import Obstacle, Surface

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


class Tube(Obstacle):
    """A ball swept along a smooth curve while its radius changes; by default the sheet is inside.

    Curve and radius are cubic splines with one knot per point, twice continuously differentiable, through all the points,
    which should have about equal distances. An open tube continues straight beyond both ends, without end and with the
    radius of its last point, which it reaches smoothly; a closed one ends in its last balls.

    Args:
        points: (k, 3) m, along the curve, in the body's own frame.
        radius: m, a number, or (k,), one a point.
        inside: True if the bodies of the scene are inside of it, a hollow.
        closed: with ends.
        center, rotation, motion: see Obstacle.

    Raises ValueError where the radius is not positive between the points, or where it changes as fast as the curve
    advances, so that one ball lies in the next.

    >>> Tube([[0, 0, 0], [1, 0, 0], [2, 0, 0]], radius=0.1).signed_distance([1, 0.04, 0]).round(6).item()
    0.06
    """

    closed: bool
    inside: bool

    def __init__(
        self,
        points: Numbers,
        radius: Numbers,
        inside: bool = True,
        closed: bool = False,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        self.points: np.ndarray = quantity("points", "m", points, ("k", 3))
        if len(self.points) < 2:
            raise ValueError(f"points [m] must be at least two, got {len(self.points)}")
        gaps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        if gaps.min() <= 1e-12 * gaps.max():
            k = int(gaps.argmin())
            raise ValueError(
                f"points [m] must differ from their neighbours, but points {k} and {k + 1} are the same"
            )
        constant = shape_of("radius [m]", radius) == ()
        given = np.full(len(self.points), radius) if constant else radius
        self.radius: np.ndarray = all_positive("radius", "m", given, (len(self.points),))
        self.inside, self.closed = flag("inside", inside), flag("closed", closed)
        shape = core.Obstacle.tube(self.points, self.radius, self.closed)
        self._of(
            shape.inverted() if inside else shape,
            points=self.points,
            radius=self.radius,
            inside=inside,
            closed=closed,
        )

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        return swept_surface(self.points, self.radius, self.closed)

    def _summary(self) -> str:
        low, high = self.radius.min(), self.radius.max()
        radius = f"{low:g} m" if low == high else f"{low:g} to {high:g} m"
        ends = "closed" if self.closed else "open"
        side = "inside" if self.inside else "outside"
        return f"{len(self.points)} points, radius {radius}, {ends}, bodies {side}"
