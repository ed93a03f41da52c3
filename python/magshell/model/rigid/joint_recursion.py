"""The links of a skeleton in a configuration: mass matrix and Newton-Euler recursion, in numpy or in torch.

The same lines compute with arrays of numpy and with tensors of torch, whose derivatives torch finds in any order. Motions
are spatial (Featherstone, Rigid Body Dynamics Algorithms, 2008): an angular velocity and the velocity of the point of the
link that is at the origin of the world.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from ..._input.tensors import detached

if TYPE_CHECKING:
    from .skeleton import Skeleton

Vector: TypeAlias = Any  # an array of numpy or a tensor of torch

_SMALL_ANGLE = 0.5  # [rad] below which the functions of rotations are series
_TERMS = 9  # of these series: the next one is below 1e-20


class LinkNumbers(NamedTuple):
    """The numbers of a link: mass [kg], inertia (3, 3) kg m2 about the center, and the center at rest, (3,) m."""

    mass: Vector
    inertia: Vector
    center: Vector


class JointNumbers(NamedTuple):
    """The numbers of a joint: its origin at rest (3,) m, the unit vector of its axis, and the pitch of a screw [m/rad]."""

    origin: Vector
    axis: Vector
    pitch: Vector


class _PosedLink(NamedTuple):
    """A link in a configuration: the number of its parent, or -1, its center [m] and rotation, its mass and inertia in the
    world's axes, and the spatial motions (k, 6) by its own coordinates. Rotations of balls and free links are about the
    world's axes through a point that moves; axes of other joints ride on the parent.
    """

    parent: int
    center: Vector
    rotation: Vector
    mass: Vector
    inertia: Vector
    own: slice
    columns: Vector
    origin: Vector
    kind: str


class Configuration:
    """The links of a skeleton at given coordinates, parents first.

    links, joints: the numbers of the links in the order of `skeleton._links_in_order`, and of the joint to each of them,
        None for a free link. own: the coordinates of each. xp: the module numpy or torch, to which all arrays belong.
    """

    def __init__(
        self,
        skeleton: Skeleton,
        links: list[LinkNumbers],
        joints: list[JointNumbers | None],
        own: list[slice],
        coordinates: Vector,
        xp: Any,
    ):
        self._xp, self._n = xp, len(coordinates)
        self._unit = xp.eye(self._n, dtype=xp.float64)
        self._axes, self._none = xp.eye(3, dtype=xp.float64), xp.zeros(3, dtype=xp.float64)
        number = {id(link): k for k, link in enumerate(skeleton._links_in_order)}
        self._links: list[_PosedLink] = []
        for k, link in enumerate(skeleton._links_in_order):
            joint = skeleton._joint_to(link)
            parent = -1 if joint is None or joint.parent is None else number[id(joint.parent)]
            turns = joint is not None and not joint._spec.slides and joint._spec.freedoms == 1
            kind = "free" if joint is None else "turning" if turns else joint._kind
            at = joints[k]
            before = links[parent].center if parent >= 0 else self._none
            posed = (
                self._free(links[k], own[k], coordinates[own[k]])
                if at is None
                else self._held(kind, links[k], at, before, parent, own[k], coordinates[own[k]])
            )
            self._links.append(posed)

    def _free(self, link: LinkNumbers, own: slice, q: Vector) -> _PosedLink:
        center, turn = link.center + q[:3], rotation_matrix(q[3:], self._xp)
        columns = self._joined([self._translations(self._axes), self._rotations(self._axes, center)])
        inertia = turn @ link.inertia @ turn.T
        return _PosedLink(-1, center, turn, link.mass, inertia, own, columns, center, "free")

    def _held(
        self, kind: str, link: LinkNumbers, joint: JointNumbers, rest, parent: int, own: slice, q: Vector
    ) -> _PosedLink:
        """Return the link that a joint holds. rest: the center of its parent at rest."""
        base, before = self._none, self._axes
        if parent >= 0:
            base, before = self._links[parent].center, self._links[parent].rotation
        origin, axis, turn = base + before @ (joint.origin - rest), before @ joint.axis, before
        columns = self._xp.zeros((0, 6), dtype=self._xp.float64)
        if kind == "ball":
            turn = before @ rotation_matrix(q, self._xp)
            columns = self._rotations(self._axes, origin)
        elif kind == "prismatic":
            origin, columns = origin + q[0] * axis, self._translations(axis[None])
        elif kind == "turning":
            turn = before @ rotation_matrix(q[0] * joint.axis, self._xp)
            columns = self._rotations(axis[None], origin) + self._translations(joint.pitch * axis[None])
            origin = origin + joint.pitch * q[0] * axis
        center = origin + turn @ (link.center - joint.origin)
        inertia = turn @ link.inertia @ turn.T
        return _PosedLink(parent, center, turn, link.mass, inertia, own, columns, origin, kind)

    def mass_matrix(self) -> Vector:
        """Return the sum of J^T m J over the links, with the Jacobians J of their motions."""
        mass, motions = 0.0 * self._unit, []
        for link in self._links:
            motion = self._unit[link.own].T @ link.columns
            if link.parent >= 0:
                motion = motion + motions[link.parent]
            motions.append(motion)
            turning = motion[:, :3]
            moving = motion[:, 3:] + self._cross(turning, link.center)
            mass = mass + link.mass * moving @ moving.T + turning @ link.inertia @ turning.T
        return 0.5 * (mass + mass.T)

    def forces(self, rates: Vector, accelerations: Vector, gravity: Vector) -> Vector:
        """Return the generalized forces by the Newton-Euler recursion."""
        cross, joined = self._cross, self._joined
        velocities, rising, wrenches = [], [], []
        for link in self._links:
            root = link.parent < 0
            velocity = joined([self._none, self._none]) if root else velocities[link.parent]
            before = joined([self._none, -gravity]) if root else rising[link.parent]
            own = rates[link.own] @ link.columns
            velocities.append(velocity + own)
            up = before + accelerations[link.own] @ link.columns
            rising.append(up + self._velocity_product(link, velocity, own))
            spin, up = velocities[-1][:3], rising[-1][:3]
            moving = velocities[-1][3:] + cross(spin, link.center)
            force = link.mass * (rising[-1][3:] + cross(up, link.center) + cross(spin, moving))
            moment = link.inertia @ up + cross(spin, link.inertia @ spin) + cross(link.center, force)
            wrenches.append(joined([moment, force]))
        found = 0.0 * rates
        for k in range(len(self._links) - 1, -1, -1):
            link = self._links[k]
            found = found + (link.columns @ wrenches[k]) @ self._unit[link.own]
            if link.parent >= 0:
                wrenches[link.parent] = wrenches[link.parent] + wrenches[k]
        return found

    def _velocity_product(self, link: _PosedLink, before: Vector, own: Vector) -> Vector:
        """Return the spatial acceleration of a link at constant rates, relative to its parent.

        before: the spatial velocity of the parent; own: that of the link relative to it.
        """
        cross = self._cross
        if link.kind in ("ball", "free"):  # the origin moves, the axes do not
            point = before[3:] + cross(before[:3], link.origin)
            if link.kind == "free":
                point = point + own[3:] + cross(own[:3], link.origin)
            return self._joined([self._none, cross(point, own[:3])])
        sliding = cross(before[:3], own[3:]) + cross(before[3:], own[:3])
        return self._joined([cross(before[:3], own[:3]), sliding])

    def _rotations(self, axes: Vector, origin: Vector) -> Vector:
        """Return the spatial motions of rotations about axes (k, 3) through a point, (k, 6)."""
        return self._xp.concatenate([axes, self._cross(origin, axes)], 1)

    def _translations(self, axes: Vector) -> Vector:
        """Return the spatial motions of translations along axes (k, 3), (k, 6)."""
        return self._xp.concatenate([0.0 * axes, axes], 1)

    def _joined(self, parts: list[Vector]) -> Vector:
        return self._xp.concatenate(parts, 0)

    def _cross(self, a: Vector, b: Vector) -> Vector:
        parts = [a[..., i] * b[..., j] - a[..., j] * b[..., i] for i, j in ((1, 2), (2, 0), (0, 1))]
        return self._xp.stack(parts, -1)


def rotation_matrix(vector: Vector, xp: Any) -> Vector:
    """Return the rotation by a rotation vector (3,) rad: I + s K + c K^2, with K the cross product with the vector.

    s = sin(a) / a and c = 2 sin(a/2)^2 / a^2 are functions of the square of the angle a, smooth at a = 0.
    """
    square = vector @ vector
    zero = 0.0 * vector[0]
    x, y, z = vector[0], vector[1], vector[2]
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    across = xp.stack([xp.stack(row, 0) for row in rows], 0)
    half = _sinc(0.25 * square, xp)
    return xp.eye(3, dtype=xp.float64) + _sinc(square, xp) * across + 0.5 * half * half * across @ across


def _sinc(square: Vector, xp: Any) -> Vector:
    """Return sin(a) / a, given a^2."""
    if float(detached(square)) >= _SMALL_ANGLE**2:
        angle = xp.sqrt(square)
        return xp.sin(angle) / angle
    sum_ = 0.0 * square
    for k in range(_TERMS - 1, -1, -1):
        sum_ = (-1) ** k / math.factorial(2 * k + 1) + square * sum_
    return sum_


def to_numbers(value: np.ndarray, xp: Any) -> Vector:
    """Return an array as it is, or as a tensor of torch if xp is torch."""
    return value if xp is np else xp.from_numpy(np.array(value))
