"""Uneven ground: height fields, ridges and mounds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .... import _core as core
from ...._input.quantity import quantity
from ...._input.scalars import flag, positive
from ._surfaces import grid_faces
from .obstacle import Obstacle, Surface

if TYPE_CHECKING:
    from ...._input.kinds import Numbers


LARGEST_UNEVENNESS = 1e-6  # [-] of the spacing: largest deviation of a step of coordinates from equal steps


class HeightField(Obstacle):
    """The ground below a surface z = h(x, y) that interpolates heights on a regular grid.

    h is a bicubic spline, twice continuously differentiable. Within two cells beyond the border it becomes constant along
    the axis that leaves the grid. The distance is that to the nearest point of the surface, not the height above it.

    Args:
        x, y: (n_x,), (n_y,) m, at least two each, rising in equal steps.
        heights: (n_x, n_y) m.
        center, rotation, motion: see Obstacle.

    >>> HeightField([0, 1], [0, 1], [[0, 0], [1, 1]]).signed_distance([0.5, 0.5, 1.5]).round(6).item()
    0.707107
    """

    x: np.ndarray
    y: np.ndarray

    def __init__(
        self,
        x: Numbers,
        y: Numbers,
        heights: Numbers,
        *,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
        motion: Callable[..., Any] | None = None,
    ) -> None:
        super().__init__(center, rotation, motion)
        self.x, self.y = _axis("x", x), _axis("y", y)
        self.heights: np.ndarray = quantity("heights", "m", heights, (len(self.x), len(self.y)))
        origin = (self.x[0], self.y[0])
        spacing = [(axis[-1] - axis[0]) / (len(axis) - 1) for axis in (self.x, self.y)]
        shape = core.Obstacle.height_field(origin, spacing, self.heights)
        self._of(shape, x=self.x, y=self.y, heights=self.heights)

    def _surface(self, extent: float, around: np.ndarray) -> Surface:
        x, y = np.meshgrid(self.x, self.y, indexing="ij")
        vertices = np.stack([x, y, self.heights], axis=-1).reshape(-1, 3)
        return vertices, grid_faces(len(self.x), len(self.y))

    def _summary(self) -> str:
        width, depth = np.ptp(self.x), np.ptp(self.y)
        low, high = self.heights.min(), self.heights.max()
        return f"{len(self.x)} x {len(self.y)} heights on {width:g} x {depth:g} m, {low:.4g} to {high:.4g} m"


def bump(
    height: float,
    length: float,
    ridge: bool = True,
    *,
    center: Numbers = (0.0, 0.0, 0.0),
    rotation: Numbers = (0.0, 0.0, 0.0),
    motion: Callable[..., Any] | None = None,
) -> HeightField:
    """Make a floor z = 0 with an endless ridge along y, or with a round mound around the center.

        z = height (1 - (2 r / length)^2)^3 within r < length / 2,        r = |x|, or sqrt(x^2 + y^2) of a mound

    It is sampled with 64 cells along the length, which is accurate to about 1e-5 of its height.

    Args:
        height: m; negative for a ditch or a hollow.
        length: m, of the ridge along x, or the diameter of the mound.
        ridge: False for a mound.
        center, rotation, motion: see Obstacle.

    >>> bump(0.002, 0.01).signed_distance([0, 0, 0.003]).round(6).item()
    0.001
    """
    height = float(quantity("height", "m", height, ()))
    length = positive("length", "m", length)
    across = np.linspace(-0.75, 0.75, 97) * length
    along = np.array([-0.75, 0.75]) * length if flag("ridge", ridge) else across
    x, y = np.meshgrid(across, along, indexing="ij")
    radius = np.abs(x) if ridge else np.hypot(x, y)
    heights = height * np.clip(1 - (2 * radius / length) ** 2, 0, None) ** 3
    return HeightField(across, along, heights, center=center, rotation=rotation, motion=motion)


def _axis(name: str, values) -> np.ndarray:
    values = quantity(name, "m", values, ("n",))
    if len(values) < 2:
        raise ValueError(f"{name} [m] must have at least two entries, got {len(values)}")
    steps = np.diff(values)
    if steps.min() <= 0:
        k = int(steps.argmin())
        raise ValueError(
            f"{name} [m] must rise, but {name}[{k}] = {values[k]:g} and {name}[{k + 1}] = {values[k + 1]:g}"
        )
    mean = (values[-1] - values[0]) / (len(values) - 1)
    k = int(np.abs(steps - mean).argmax())
    if abs(steps[k] - mean) > LARGEST_UNEVENNESS * mean:
        raise ValueError(
            f"{name} [m] must rise in equal steps of {mean:g}, but {name}[{k + 1}] - {name}[{k}] is {steps[k]:g}"
        )
    return values
