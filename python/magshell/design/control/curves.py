"""Curves in space for the track of a point to follow: polylines, arcs, and chains of both.

A curve computes its point nearest to a given one, and the distance, exactly and with derivatives of every order
wherever the nearest point is unique. The curve itself is fixed. Its squared distance is smooth on the curve and
around its ends; it has a kink only where two points of the curve are equally near: inside a corner, on the axis of
an arc.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..._input.checked_list import listed
from ..._input.quantity import quantity
from ..._input.tensors import require_torch
from ..._runtime.frozen import Frozen
from ._arguments import tensor

if TYPE_CHECKING:
    import torch

    from ..._input.kinds import Numbers


_TURN = 2 * np.pi


class Curve(Frozen, ABC):
    """A curve in space with a start, an end and a length. length: m. start, end: its end points, (3,) m."""

    length: float

    @abstractmethod
    def nearest(self, points: Numbers) -> torch.Tensor:
        """Return the point of the curve nearest to each of the points (n, 3) m, as (n, 3) m."""

    @abstractmethod
    def at(self, fractions: Numbers) -> torch.Tensor:
        """Return points (n, 3) m of the curve at fractions (n,) of its length, from 0, its start, to 1, its end."""

    def squared_distance(self, points: Numbers) -> torch.Tensor:
        """Return the squared distances of points (n, 3) m from the curve, (n,) m2."""
        points = tensor("points", "m", points, ("n", 3))
        return ((points - self.nearest(points)) ** 2).sum(-1)

    @property
    def start(self) -> torch.Tensor:
        """The start of the curve, (3,) m."""
        return self.at([0.0])[0]

    @property
    def end(self) -> torch.Tensor:
        """The end of the curve, (3,) m."""
        return self.at([1.0])[0]


class Polyline(Curve):
    """A curve of straight segments: one segment, a polygon (its first point repeated), or a sampled curve.

    points: (k, 3) m, at least two, no point the same as the next.

    >>> corner = ms.control.Polyline([(0, 0, 0), (0.02, 0, 0), (0.02, 0, 0.01)])  # doctest: +SKIP
    >>> corner.length, corner.squared_distance([(0.01, 3e-3, 4e-3)])  # doctest: +SKIP
    (0.03, tensor([2.5000e-05], dtype=torch.float64))
    """

    def __init__(self, points: Numbers):
        corners = quantity("points", "m", points, ("k", 3))
        if len(corners) < 2:
            raise ValueError(f"points [m] must be at least two, got {len(corners)}")
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        if not lengths.all():
            k = int(np.argmin(lengths))
            raise ValueError(f"points[{k}] and points[{k + 1}] are the same point")
        self.length: float = float(lengths.sum())
        self._corners, self._limits = tensor("points", "m", corners, ("k", 3)), _piece_limits(lengths)

    def nearest(self, points: Numbers) -> torch.Tensor:
        points = tensor("points", "m", points, ("n", 3))
        begin, along = self._corners[:-1], self._corners.diff(dim=0)
        fractions = ((points[:, None] - begin) * along).sum(-1) / (along**2).sum(-1)
        return _nearest_of(points, begin + fractions.clamp(0, 1)[..., None] * along)

    def at(self, fractions: Numbers) -> torch.Tensor:
        piece, within = _located(fractions, self._limits)
        return self._corners[piece] + within[:, None] * self._corners.diff(dim=0)[piece]


class Arc(Curve):
    """An arc of a circle, or all of it.

    center: (3,) m. start: (3,) m, where it begins. axis: (3,), perpendicular to start - center, of any length but zero.
    angle: rad, counter-clockwise about the axis, up to a full turn; clockwise if negative.

    >>> quarter = ms.control.Arc((0, 0, 0.02), start=(0, 0, 0), axis=(0, -1, 0), angle=np.pi / 2)  # doctest: +SKIP
    >>> quarter.end  # doctest: +SKIP
    tensor([0.0200, 0.0000, 0.0200], dtype=torch.float64)
    """

    length: float

    def __init__(self, center: Numbers, start: Numbers, axis: Numbers, angle: float):
        center = quantity("center", "m", center, (3,))
        arm = quantity("start", "m", start, (3,)) - center
        axis = quantity("axis", "1", axis, (3,))
        angle = float(quantity("angle", "rad", angle, ()))
        self._radius, axis_length = float(np.linalg.norm(arm)), np.linalg.norm(axis)
        if not self._radius > 0:
            raise ValueError("start and center are the same point")
        if not axis_length > 0:
            raise ValueError("axis must not be zero")
        if abs(arm @ axis) > 1e-9 * self._radius * axis_length:
            raise ValueError("axis must be perpendicular to start - center")
        if not 0 < abs(angle) <= _TURN:
            raise ValueError(f"angle [rad] must not be zero, nor more than a full turn, got {angle}")
        outwards = arm / self._radius
        onwards = np.sign(angle) * np.cross(axis / axis_length, outwards)
        self._angle, self.length = abs(angle), abs(angle) * self._radius
        self._center = tensor("center", "m", center, (3,))
        self._plane = tensor("plane", "1", np.stack([outwards, onwards]), (2, 3))

    def nearest(self, points: Numbers) -> torch.Tensor:
        torch = require_torch("ms.control.Arc")
        points = tensor("points", "m", points, ("n", 3))
        center, plane = self._center, self._plane
        flat = (points - center) @ plane.T
        squares = (flat**2).sum(-1, keepdim=True)
        # For a point on the axis the whole circle is equally near. Then its start is taken, and the root of zero, which
        # has no derivative, is avoided.
        off_axis = squares > 0
        direction = torch.where(off_axis, flat, flat.new_tensor([1.0, 0.0]))
        direction = direction / torch.where(off_axis, squares, torch.ones_like(squares)) ** 0.5
        on_circle = center + self._radius * direction @ plane
        angles = torch.atan2(direction[:, 1], direction[:, 0]).detach().remainder(_TURN)
        ends = torch.stack([self.start, self.end]).expand(len(points), 2, 3)
        return torch.where((angles <= self._angle)[:, None], on_circle, _nearest_of(points, ends))

    def at(self, fractions: Numbers) -> torch.Tensor:
        angles = _checked_fractions(fractions)[:, None] * self._angle
        return self._center + self._radius * (angles.cos() * self._plane[0] + angles.sin() * self._plane[1])


class Chain(Curve):
    """A curve of several curves one after another, each starting where the one before ends.

    pieces: curves of ms.control.

    >>> import magshell as ms
    >>> along, up = ms.control.Polyline([(0, 0, 0), (1, 0, 0)]), ms.control.Polyline([(1, 0, 0), (1, 1, 0)])
    >>> ell = ms.control.Chain([along, up])
    >>> ell.start, ell.end
    (tensor([0., 0., 0.], dtype=torch.float64), tensor([1., 1., 0.], dtype=torch.float64))
    """

    length: float

    def __init__(self, pieces: Sequence[Curve]):
        self._pieces = listed("pieces", pieces, lambda given: isinstance(given, Curve))
        if not self._pieces or not all(isinstance(piece, Curve) for piece in self._pieces):
            raise ValueError("pieces must be curves of ms.control, at least one")
        lengths = np.array([piece.length for piece in self._pieces])
        self.length, self._limits = float(lengths.sum()), _piece_limits(lengths)
        for k in range(1, len(lengths)):
            gap = float((self._pieces[k].start - self._pieces[k - 1].end).norm())
            if gap > 1e-6 * self.length:
                raise ValueError(f"pieces[{k}] starts {gap:.3g} m away from the end of the piece before it")

    def nearest(self, points: Numbers) -> torch.Tensor:
        torch = require_torch("ms.control.Chain")
        points = tensor("points", "m", points, ("n", 3))
        return _nearest_of(points, torch.stack([piece.nearest(points) for piece in self._pieces], dim=1))

    def at(self, fractions: Numbers) -> torch.Tensor:
        torch = require_torch("ms.control.Chain")
        piece, within = _located(fractions, self._limits)
        return _picked(torch.stack([each.at(within) for each in self._pieces], dim=1), piece)


def _piece_limits(lengths: np.ndarray) -> np.ndarray:
    """Return the fractions of the total length at which the pieces begin and end, (k + 1,)."""
    return np.append(0.0, np.cumsum(lengths)) / lengths.sum()


def _checked_fractions(fractions):
    """Return fractions of a length as a tensor. Raises ValueError if one is not in 0 ... 1."""
    fractions = tensor("fractions", "1", fractions, ("n",))
    outside = (fractions.detach() < 0) | (fractions.detach() > 1)
    if outside.any():
        raise ValueError(f"fractions must lie in 0 ... 1, got {fractions.detach()[outside][0].item():g}")
    return fractions


def _located(fractions, limits: np.ndarray):
    """Return the piece in which each fraction of the total length lies, and the fraction of that piece's length."""
    fractions = _checked_fractions(fractions)
    piece = np.searchsorted(limits[1:-1], fractions.detach().numpy(), side="right")
    begin, end = fractions.new_tensor(limits[piece]), fractions.new_tensor(limits[piece + 1])
    return fractions.new_tensor(piece).long(), ((fractions - begin) / (end - begin)).clamp(0, 1)


def _nearest_of(points, candidates):
    """Return for each of the points (n, 3) the nearest of its candidates (n, k, 3)."""
    return _picked(candidates, ((points.detach()[:, None] - candidates.detach()) ** 2).sum(-1).argmin(1))


def _picked(candidates, which):
    """Return candidates[i, which[i]]: (n, 3) from candidates (n, k, 3) and which (n,)."""
    return candidates.gather(1, which[:, None, None].expand(-1, 1, 3))[:, 0]
