"""Permanent magnets of simple shapes as field sources, by closed forms as in magpylib, with gradients.

A magnet has a field but no surface, so nothing stops a body from entering it; messages name vertices inside one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ... import _core as core
from ..._input.quantity import quantity
from ..._input.scalars import all_positive, positive
from .field import AppliedField

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Magnet(AppliedField):
    """A uniformly magnetised body; the base class of magnets.

    A point x of the world is y = R^T (x - center) in the magnet's own frame, R = exp(rotation). The remanent
    magnetization M_r [A/m] is given in that frame and rotates with the magnet; `magnetization_from_remanence` computes it
    from the residual flux density [T] of a data sheet. The magnet is ideally hard: no field changes M_r.

    B = mu_0 (H + M_r) inside, mu_0 H outside; on a face it has the value just outside, on an edge NaN. Across a face B
    jumps, so no sheet should pass through one: a Contact with an obstacle of the same shape keeps it out.
    """

    _in_time = ("remanent_magnetization", "center", "rotation")

    def __init__(self, remanent_magnetization: Numbers, center: Numbers, rotation: Numbers) -> None:
        self.remanent_magnetization: np.ndarray = quantity(
            "remanent_magnetization", "A/m", remanent_magnetization, (3,)
        )
        self.center: np.ndarray = quantity("center", "m", center, (3,))
        self.rotation: np.ndarray = quantity("rotation", "rad", rotation, (3,))
        self._made_from = {name: getattr(self, name) for name in self._replaceable}
        self._core = getattr(core, type(self).__name__)(**self._made_from)

    def replaced(self, **values: Any) -> Magnet:
        """Return a magnet of the same shape with other sizes, magnetization, center or rotation."""
        if unknown := sorted(set(values) - set(self._replaceable)):
            raise ValueError(
                f"{type(self).__name__} has no value {unknown[0]!r} to be replaced: it has "
                f"{', '.join(self._replaceable)}"
            )
        return type(self)(**{**self._made_from, **values})

    def _in_magnets(self, points: np.ndarray) -> np.ndarray:
        own = (
            scipy.spatial.transform.Rotation.from_rotvec(np.array(self.rotation))
            .inv()
            .apply(points - self.center)
        )
        return self._holds(own)

    def _described(self, size: str) -> str:
        parts = [size, f"M_r ({_listed(self.remanent_magnetization)}) A/m"]
        if self.center.any():
            parts.append(f"center ({_listed(self.center)}) m")
        if self.rotation.any():
            parts.append(f"rotation ({_listed(self.rotation)}) rad")
        return f"{type(self).__name__}({', '.join(parts)})"


class CuboidMagnet(Magnet):
    """A cuboid, magnetised uniformly in any direction.

    The field and its first two derivatives are computed by a closed form (charges on six faces: arctangents and logarithms
    at eight corners, e.g. Engel-Herbert and Hesjedal 2005), written so that it holds on the lines and planes that continue
    edges and faces. Farther than about 12 half diagonals of a cube (4 to 6 of a rod or a plate), where the closed form
    would lose digits, charges at Gauss points in the body are used instead.

    Args:
        dimensions: (3,) m, the lengths of its edges along the axes of its own frame.
        remanent_magnetization: (3,) A/m, in its own frame.
        center: (3,) m.
        rotation: rotation vector (3,) rad, about the center.

    All of them may be replaced in a solve and differentiated by. Raises ValueError on edges that are not positive.

    >>> cube = CuboidMagnet((0.01, 0.01, 0.01), remanent_magnetization=(0, 0, 1e6))
    >>> cube.flux_density([0, 0, 0.02]).round(4)
    array([0.    , 0.    , 0.0247])
    """

    _replaceable = ("dimensions", "remanent_magnetization", "center", "rotation")

    def __init__(
        self,
        dimensions: Numbers,
        remanent_magnetization: Numbers,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
    ) -> None:
        self.dimensions: np.ndarray = all_positive("dimensions", "m", dimensions, (3,))
        super().__init__(remanent_magnetization, center, rotation)

    def _sphere_around_sources(self) -> tuple[np.ndarray, float]:
        return self.center, 0.5 * float(np.linalg.norm(self.dimensions))

    def _holds(self, points: np.ndarray) -> np.ndarray:
        return (np.abs(points) < 0.5 * self.dimensions).all(axis=1)

    def __repr__(self) -> str:
        return self._described(f"{' x '.join(f'{edge:g}' for edge in self.dimensions)} m")


class CylinderMagnet(Magnet):
    """A cylinder, magnetised uniformly in any direction: along its axis, across it, or between.

    The field is exact to round-off. The charge on its surface is integrated along the axis in closed form, and around it
    by the trapezoidal rule in Jacobi's parameter of the complete elliptic integrals in the closed forms (Derby and Olbert
    2010, Caciagli et al. 2018). The rule converges exponentially, with 12 points at least and 100 at a millionth of the
    radius from an edge, and all derivatives are available. At large distances charges in the body are used, as for the
    cuboid.

    Args:
        radius: m.
        height: m, along the third axis of its own frame, half of it on each side of the center.
        remanent_magnetization: (3,) A/m, in its own frame.
        center: (3,) m.
        rotation: rotation vector (3,) rad, about the center.

    All of them may be replaced in a solve and differentiated by. Raises ValueError on sizes that are not positive.

    >>> disk = CylinderMagnet(radius=0.01, height=0.005, remanent_magnetization=(0, 0, 1e6))
    >>> disk.flux_density([0, 0, 0.02]).round(4)
    array([0.    , 0.    , 0.0286])
    """

    _replaceable = ("radius", "height", "remanent_magnetization", "center", "rotation")

    def __init__(
        self,
        radius: Numbers,
        height: Numbers,
        remanent_magnetization: Numbers,
        center: Numbers = (0.0, 0.0, 0.0),
        rotation: Numbers = (0.0, 0.0, 0.0),
    ) -> None:
        self.radius: float = positive("radius", "m", radius)
        self.height: float = positive("height", "m", height)
        super().__init__(remanent_magnetization, center, rotation)

    def _sphere_around_sources(self) -> tuple[np.ndarray, float]:
        return self.center, float(np.hypot(self.radius, 0.5 * self.height))

    def _holds(self, points: np.ndarray) -> np.ndarray:
        within = np.linalg.norm(points[:, :2], axis=1) < self.radius
        return within & (np.abs(points[:, 2]) < 0.5 * self.height)

    def __repr__(self) -> str:
        return self._described(f"radius {self.radius:g} m, height {self.height:g} m")


def _listed(vector: np.ndarray) -> str:
    return ", ".join(f"{x:g}" for x in vector)


_MOST_NAMED = 4  # largest number of vertices in the message


def describe_magnet_overlap(
    fields: Iterable[AppliedField], positions: np.ndarray, edge_lengths: np.ndarray
) -> str:
    """Return a sentence for an error message that names the vertices inside a magnet, or within half a mean edge of it.

    positions: (n_v, 3) m. Returns "" if there are none.
    """
    near = 0.5 * float(np.mean(edge_lengths)) if len(edge_lengths) else 0.0
    around = np.concatenate([np.zeros((1, 3)), near * np.eye(3), -near * np.eye(3)])
    points = (positions[:, None] + around).reshape(-1, 3)
    found = np.zeros((len(positions), len(around)), dtype=bool)
    for field in fields:
        found |= field._in_magnets(points).reshape(found.shape)
    vertices = np.flatnonzero(found.any(axis=1))
    if not len(vertices):
        return ""
    where = "are inside of a magnet" if found[:, 0].any() else f"are within {near:.2g} m of a magnet"
    named = ", ".join(map(str, vertices[:_MOST_NAMED])) + (", ..." if len(vertices) > _MOST_NAMED else "")
    return (
        f"{len(vertices)} of {len(positions)} vertices ({named}) {where} or about to enter it. The field has another "
        "formula there, and a magnet alone does not stop a body: add a Contact with an obstacle of its shape, or keep the "
        "magnet farther away."
    )
