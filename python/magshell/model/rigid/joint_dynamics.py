"""Rigid-body dynamics of skeletons in joint coordinates: inverse and forward dynamics, mass matrix and bias forces.

With the coordinates q of the joints, their rates z and the generalized forces tau, M(q) dz/dt + b(q, z) = tau
(Featherstone, Rigid Body Dynamics Algorithms, 2008). Motions are spatial: an angular velocity and the velocity of the point
of the link that is at the origin of the world.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from ..._input.quantity import quantity
from ..._input.tensors import requires_gradient
from ...errors import NoGradient
from .joints import Joint, LoopClosure
from .rigid import RigidBody
from .skeleton import Skeleton

if TYPE_CHECKING:
    from ..._input.kinds import Numbers

_SINGULAR = 1e-14  # [-] smallest eigenvalue of the mass matrix scaled to a diagonal of ones


def coordinate_slices(skeleton: Skeleton) -> dict[Joint | RigidBody, slice]:
    """Return the place of each joint, and of each link without a joint, in the vectors of coordinates.

    Joints come first, in the order of `skeleton.joints`; Fixed joints and LoopClosures have no coordinates. A Revolute or a
    Screw has an angle [rad], a Prismatic a displacement [m], and a Ball the rotation vector (3,) rad from the parent to
    the child, in the world's axes at rest, which ride on the parent. A free link has six numbers: the displacement of its
    center [m], and its rotation vector [rad].

    Rates are those of a motion (`result[joint].rate`): of a Ball the angular velocity of the child relative to the parent
    in the world's axes, of a free link the velocity of its center and its angular velocity. Forces are those that do work at
    these rates: a torque [N m], a force [N], a moment in the world's axes, a force at the center and a moment.

    Raises ValueError if skeleton is not a Skeleton.

    >>> import magshell as ms
    >>> base, bob = (ms.Link(mass=1.0, inertia=0.1, center=(0, 0, z)) for z in (0.0, -1.0))
    >>> hinge = ms.Revolute(bob, base, origin=(0, 0, 0), axis=(0, 1, 0))
    >>> [(each.start, each.stop) for each in ms.coordinate_slices(ms.Skeleton([base, bob], [hinge])).values()]
    [(0, 1), (1, 7)]
    """
    if not isinstance(skeleton, Skeleton):
        raise ValueError(f"skeleton must be a Skeleton, got {type(skeleton).__name__}")
    counts = {joint: joint._spec.freedoms for joint in skeleton.joints if not isinstance(joint, LoopClosure)}
    counts |= {link: 6 for link in skeleton.links if skeleton._joint_to(link) is None}
    found, first = {}, 0
    for each, count in counts.items():
        if count:
            found[each] = slice(first, first + count)
            first += count
    return found


def inverse_dynamics(
    skeleton: Skeleton,
    coordinates: Numbers,
    rates: Numbers,
    accelerations: Numbers,
    *,
    gravity: Numbers = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Return the generalized forces that a motion needs, (n,) N m or N: Pinocchio's rnea, recursive Newton-Euler.

    skeleton: the Skeleton, at rest where all coordinates are zero.
    coordinates, rates, accelerations: (n,), in the order and units of `coordinate_slices`; accelerations are the derivatives
        of the rates.
    gravity: (3,) m/s2.

    The forces are those of all that acts in the joints together. Springs, dampers, torques, limits and motors of the
    joints, forces on links and loop closures are not subtracted. Raises ValueError for links with vertices, whose masses
    belong to a scene; NoGradient for tensors that need a gradient.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.inverse_dynamics(arm, [0.0], [0.0], [0.5], gravity=(0, 0, -10.0)).round(9)  # m L^2 a + m g L
    array([21.])
    """
    given = _Given(skeleton, coordinates, rates=rates, accelerations=accelerations, gravity=gravity)
    return _Configuration(skeleton, given.coordinates).forces(given.rates, given.accelerations, given.gravity)


def bias_forces(
    skeleton: Skeleton, coordinates: Numbers, rates: Numbers, *, gravity: Numbers = (0.0, 0.0, 0.0)
) -> np.ndarray:
    """Return the forces at zero accelerations, (n,) N m or N: Coriolis and centrifugal forces, and the weight.

    Pinocchio calls it nonLinearEffects. skeleton, coordinates, rates, gravity and errors: as in `inverse_dynamics`.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.bias_forces(arm, [0.0], [3.0], gravity=(0, 0, -10.0)).round(9)
    array([20.])
    """
    given = _Given(skeleton, coordinates, rates=rates, gravity=gravity)
    return _Configuration(skeleton, given.coordinates).forces(
        given.rates, np.zeros_like(given.rates), given.gravity
    )


def mass_matrix(skeleton: Skeleton, coordinates: Numbers) -> np.ndarray:
    """Return the mass matrix M of a configuration, (n, n), symmetric, in SI units: Pinocchio's crba.

    z . M z / 2 is the kinetic energy at the rates z. skeleton, coordinates and errors: as in `inverse_dynamics`.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.mass_matrix(arm, [0.3]).round(9)
    array([[2.]])
    """
    return _Configuration(skeleton, _Given(skeleton, coordinates).coordinates).mass_matrix()


def forward_dynamics(
    skeleton: Skeleton,
    coordinates: Numbers,
    rates: Numbers,
    forces: Numbers,
    *,
    gravity: Numbers = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Return the accelerations under generalized forces, (n,) rad/s2 or m/s2: M dz/dt = forces - bias_forces.

    Pinocchio calls it aba. forces: (n,) of all that acts in the joints and on free links, in the order and units of
    `coordinate_slices`. Springs and the like of the joints act only as far as they are in `forces`. skeleton, coordinates,
    rates, gravity and errors: as in `inverse_dynamics`; raises ValueError also if a motion has no inertia.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.forward_dynamics(arm, [0.0], [0.0], [21.0], gravity=(0, 0, -10.0)).round(9)
    array([0.5])
    """
    given = _Given(skeleton, coordinates, rates=rates, forces=forces, gravity=gravity)
    at = _Configuration(skeleton, given.coordinates)
    mass = at.mass_matrix()
    scale = np.sqrt(np.diag(mass))
    if not (scale > 0).all() or np.linalg.eigvalsh(mass / np.outer(scale, scale))[0] < _SINGULAR:
        raise ValueError(
            "the mass matrix is singular: some motion of the joints moves no mass; give the links masses and inertias"
        )
    bias = at.forces(given.rates, np.zeros_like(given.rates), given.gravity)
    return np.linalg.solve(mass, given.forces - bias)


class _Given:
    """The checked arguments of a function: vectors of one number per coordinate, and gravity."""

    def __init__(self, skeleton: Skeleton, coordinates: Numbers, **others: Numbers):
        n = max((each.stop for each in coordinate_slices(skeleton).values()), default=0)
        for k, link in enumerate(skeleton.links):
            if link.vertices is not None:
                raise ValueError(
                    f"link {k} has vertices, whose masses belong to a scene: dynamics in joint coordinates need links with "
                    "all of their mass"
                )
        for name, value in {"coordinates": coordinates, **others}.items():
            if requires_gradient(value):
                raise NoGradient(f"{name} is a tensor that needs a gradient, and this function has none")
            unit, shape = ("m/s2", (3,)) if name == "gravity" else ("SI", (n,))
            setattr(self, name, quantity(name, unit, value, shape))

    coordinates: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    forces: np.ndarray
    gravity: np.ndarray


class _PosedLink(NamedTuple):
    """A link in a configuration: the number of its parent, or -1, its center [m] and rotation, its mass and inertia in the
    world's axes, and the spatial motions (k, 6) by its own coordinates. Rotations of balls and free links are about the
    world's axes through a point that moves; axes of other joints ride on the parent.
    """

    parent: int
    center: np.ndarray
    rotation: np.ndarray
    mass: float
    inertia: np.ndarray
    own: slice
    columns: np.ndarray
    origin: np.ndarray
    kind: str


class _Configuration:
    """The links of a skeleton at given coordinates, parents first."""

    def __init__(self, skeleton: Skeleton, coordinates: np.ndarray):
        self._n = len(coordinates)
        slices, links = coordinate_slices(skeleton), skeleton._links_in_order
        number = {id(link): k for k, link in enumerate(links)}
        self._links: list[_PosedLink] = []
        for link in links:
            joint = skeleton._joint_to(link)
            own = slices.get(link if joint is None else joint, slice(0, 0))
            parent = -1 if joint is None or joint.parent is None else number[id(joint.parent)]
            self._links.append(self._posed(link, joint, parent, own, coordinates[own], links))

    def _posed(self, link, joint, parent: int, own: slice, q: np.ndarray, links) -> _PosedLink:
        rest, axes = _center(link), np.eye(3)
        base, before = np.zeros(3), np.eye(3)
        if parent >= 0:
            base, before = self._links[parent].center, self._links[parent].rotation
        kind = "free" if joint is None else joint._kind
        if joint is None:
            origin = center = rest + q[:3]
            turn = _rotation(q[3:])
            columns = np.concatenate([_translations_along(axes), _rotations_about(axes, origin)])
        else:
            arm = joint.origin - (_center(links[parent]) if parent >= 0 else 0.0)
            origin, axis, turn = base + before @ arm, before @ joint.axis, before
            columns = np.zeros((0, 6))
            if kind == "ball":
                turn, columns = before @ _rotation(q), _rotations_about(axes, origin)
            elif joint._spec.slides:
                origin, columns = origin + q[0] * axis, _translations_along(axis[None])
            elif joint._spec.freedoms:
                turn = before @ _rotation(q[0] * joint.axis)
                columns = _rotations_about(axis[None], origin) + _translations_along(
                    joint._pitch * axis[None]
                )
                origin = origin + joint._pitch * q[0] * axis
            center = origin + turn @ (rest - joint.origin)
        inertia = turn @ link.inertia_tensor @ turn.T
        return _PosedLink(parent, center, turn, link.mass or 0.0, inertia, own, columns, origin, kind)

    def mass_matrix(self) -> np.ndarray:
        """Return the sum of J^T m J over the links, with the Jacobians J of their motions."""
        mass, motions = np.zeros((self._n, self._n)), []
        for link in self._links:
            motion = np.zeros((self._n, 6)) if link.parent < 0 else motions[link.parent].copy()
            motion[link.own] += link.columns
            motions.append(motion)
            turning = motion[:, :3]
            moving = motion[:, 3:] + np.cross(turning, link.center)
            mass += link.mass * moving @ moving.T + turning @ link.inertia @ turning.T
        return 0.5 * (mass + mass.T)

    def forces(self, rates: np.ndarray, accelerations: np.ndarray, gravity: np.ndarray) -> np.ndarray:
        """Return the generalized forces by the Newton-Euler recursion."""
        velocities, rising, wrenches = [], [], []
        for link in self._links:
            root = link.parent < 0
            velocity = np.zeros(6) if root else velocities[link.parent]
            before = np.concatenate([np.zeros(3), -gravity]) if root else rising[link.parent]
            own = rates[link.own] @ link.columns
            velocities.append(velocity + own)
            rising.append(
                before + accelerations[link.own] @ link.columns + _velocity_product(link, velocity, own)
            )
            spin, up = velocities[-1][:3], rising[-1][:3]
            moving = velocities[-1][3:] + np.cross(spin, link.center)
            force = link.mass * (rising[-1][3:] + np.cross(up, link.center) + np.cross(spin, moving))
            moment = link.inertia @ up + np.cross(spin, link.inertia @ spin) + np.cross(link.center, force)
            wrenches.append(np.concatenate([moment, force]))
        found = np.zeros(self._n)
        for k in range(len(self._links) - 1, -1, -1):
            link = self._links[k]
            found[link.own] = link.columns @ wrenches[k]
            if link.parent >= 0:
                wrenches[link.parent] = wrenches[link.parent] + wrenches[k]
        return found


def _velocity_product(link: _PosedLink, before: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return the spatial acceleration of a link at constant rates, relative to its parent.

    before: the spatial velocity of the parent; own: that of the link relative to it.
    """
    if link.kind in ("ball", "free"):  # the origin moves, the axes do not
        point = own[3:] + np.cross(own[:3], link.origin) if link.kind == "free" else 0.0
        point = point + before[3:] + np.cross(before[:3], link.origin)
        return np.concatenate([np.zeros(3), np.cross(point, own[:3])])
    turned = np.cross(before[:3], own[:3])
    return np.concatenate([turned, np.cross(before[:3], own[3:]) + np.cross(before[3:], own[:3])])


def _rotation(vector: np.ndarray) -> np.ndarray:
    return scipy.spatial.transform.Rotation.from_rotvec(
        np.array(vector)
    ).as_matrix()  # a copy, as scipy takes no read-only arrays


def _rotations_about(axes: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Return the spatial motions of rotations about axes (k, 3) through a point, (k, 6)."""
    return np.concatenate([axes, np.cross(origin, axes)], axis=1)


def _translations_along(axes: np.ndarray) -> np.ndarray:
    """Return the spatial motions of translations along axes (k, 3), (k, 6)."""
    return np.concatenate([np.zeros_like(axes), axes], axis=1)


def _center(link: RigidBody) -> np.ndarray:
    return np.zeros(3) if link.center is None else link.center
