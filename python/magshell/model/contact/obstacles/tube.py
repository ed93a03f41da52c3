"""Obstacles with a round cross-section along a curve: pipes, tunnels and horns."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.quantity import quantity, shape_of
from ...._input.scalars import all_positive, flag
from ._surfaces import swept_surface
from .obstacle import NO_MIDDLE, Obstacle, Surface, points_between

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


class Tube(Obstacle):
    """A hollow tube, or a solid rod, with a radius that may change along its smooth center line.

    Its surface is the envelope of balls whose centers move along the center line. By default bodies are kept inside it.

    The center line and the radius are cubic splines through all given values, twice continuously differentiable, with one
    knot per point. Neighbouring points should have about equal distances. An open tube (the default) continues straight and
    to infinity beyond its first and last point, with the radius given there; the radius becomes constant smoothly, within
    three knots. A closed tube ends at its first and last point with half a ball.

    Args:
        points: (k, 3) m, points of the center line in the obstacle's own frame, two at least.
        radius: m, one number, or (k,) with one number per point.
        inside: True if bodies are kept inside the surface (a pipe), False if outside (a rod).
        closed: whether the tube ends at its first and last point.
        center, rotation, motion: see Obstacle.

    Raises ValueError if the radius is not positive somewhere between the points, or if it changes by as much as the center
    line advances, so that one ball contains the next.

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

    @property
    def _middle(self) -> tuple[np.ndarray, float]:
        if self.inside:
            return NO_MIDDLE
        radius, points = float(self.radius.min()), self.points
        parts = [points_between(a, b, radius) for a, b in pairwise(points)]
        return np.concatenate(parts), radius

    def _summary(self) -> str:
        low, high = self.radius.min(), self.radius.max()
        radius = f"{low:g} m" if low == high else f"{low:g} to {high:g} m"
        ends = "closed" if self.closed else "open"
        side = "inside" if self.inside else "outside"
        return f"{len(self.points)} points, radius {radius}, {ends}, bodies {side}"
