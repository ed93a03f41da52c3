"""Rigid-body dynamics of skeletons in joint coordinates: inverse and forward dynamics, mass matrix and bias forces.

With the coordinates q of the joints, their rates z and the generalized forces tau, M(q) dz/dt + b(q, z) = tau
(Featherstone, Rigid Body Dynamics Algorithms, 2008); `joint_recursion` computes them. Where an argument is a tensor of
torch, so is the result, in its graph.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity
from ..._input.tensor_kinds import is_tensor
from ..._input.tensors import detached, dtype_like, require_torch
from .joint_recursion import Configuration, JointNumbers, LinkNumbers, to_numbers
from .joints import Fixed, Joint, LoopClosure
from .rigid import RigidBody, or_zero
from .skeleton import Skeleton

if TYPE_CHECKING:
    from ..._input.kinds import Computed, Numbers

    Replaced = Mapping[Any, Mapping[str, Numbers]]

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
    values: Replaced | None = None,
) -> Computed:
    """Return the generalized forces that a motion needs, (n,) N m or N: Pinocchio's rnea, recursive Newton-Euler.

    skeleton: the Skeleton, at rest where all coordinates are zero.
    coordinates, rates, accelerations: (n,), in the order and units of `coordinate_slices`; accelerations are the derivatives
        of the rates.
    gravity: (3,) m/s2.
    values: other numbers of links and joints than those of the skeleton, {link: {"mass": ...}, joint: {"origin": ...}}: the
        mass, inertia and center of links; the origin, axis and pitch of joints.

    The forces are those of all that acts in the joints together. Springs, dampers, torques, limits and motors of the
    joints, forces on links and loop closures are not subtracted. If an argument or a value is a tensor, the result is one
    in its graph, with derivatives of every order by all of them. Raises ValueError for links with vertices, whose masses
    belong to a scene, and for values that have no effect.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.inverse_dynamics(arm, [0.0], [0.0], [0.5], gravity=(0, 0, -10.0)).round(9)  # m L^2 a + m g L
    array([21.])
    """
    given = _Given(
        skeleton, values, coordinates=coordinates, rates=rates, accelerations=accelerations, gravity=gravity
    )
    return given.result(given.configuration.forces(given.rates, given.accelerations, given.gravity))


def bias_forces(
    skeleton: Skeleton,
    coordinates: Numbers,
    rates: Numbers,
    *,
    gravity: Numbers = (0.0, 0.0, 0.0),
    values: Replaced | None = None,
) -> Computed:
    """Return the forces at zero accelerations, (n,) N m or N: Coriolis and centrifugal forces, and the weight.

    Pinocchio calls it nonLinearEffects. skeleton, coordinates, rates, gravity, values, derivatives and errors: as in
    `inverse_dynamics`.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.bias_forces(arm, [0.0], [3.0], gravity=(0, 0, -10.0)).round(9)
    array([20.])
    """
    given = _Given(skeleton, values, coordinates=coordinates, rates=rates, gravity=gravity)
    return given.result(given.configuration.forces(given.rates, 0.0 * given.rates, given.gravity))


def mass_matrix(skeleton: Skeleton, coordinates: Numbers, *, values: Replaced | None = None) -> Computed:
    """Return the mass matrix M of a configuration, (n, n), symmetric, in SI units: Pinocchio's crba.

    z . M z / 2 is the kinetic energy at the rates z. skeleton, coordinates, values, derivatives and errors: as in
    `inverse_dynamics`.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.mass_matrix(arm, [0.3]).round(9)
    array([[2.]])
    """
    given = _Given(skeleton, values, coordinates=coordinates)
    return given.result(given.configuration.mass_matrix())


def forward_dynamics(
    skeleton: Skeleton,
    coordinates: Numbers,
    rates: Numbers,
    forces: Numbers,
    *,
    gravity: Numbers = (0.0, 0.0, 0.0),
    values: Replaced | None = None,
) -> Computed:
    """Return the accelerations under generalized forces, (n,) rad/s2 or m/s2: M dz/dt = forces - bias_forces.

    Pinocchio calls it aba. forces: (n,) of all that acts in the joints and on free links, in the order and units of
    `coordinate_slices`. Springs and the like of the joints act only as far as they are in `forces`. skeleton, coordinates,
    rates, gravity, values, derivatives and errors: as in `inverse_dynamics`; raises ValueError also if a motion has no
    inertia.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=2.0, center=(1.0, 0, 0))
    >>> arm = ms.Skeleton([bob], [ms.Revolute(bob, origin=(0, 0, 0), axis=(0, -1, 0))])
    >>> ms.forward_dynamics(arm, [0.0], [0.0], [21.0], gravity=(0, 0, -10.0)).round(9)
    array([0.5])
    """
    given = _Given(skeleton, values, coordinates=coordinates, rates=rates, forces=forces, gravity=gravity)
    matrix = given.configuration.mass_matrix()
    numbers = detached(matrix)
    scale = np.sqrt(np.diag(numbers))
    if not (scale > 0).all() or np.linalg.eigvalsh(numbers / np.outer(scale, scale))[0] < _SINGULAR:
        raise ValueError(
            "the mass matrix is singular: some motion of the joints moves no mass; give the links masses and inertias"
        )
    bias = given.configuration.forces(given.rates, 0.0 * given.rates, given.gravity)
    return given.result(given.xp.linalg.solve(matrix, given.forces - bias))


class _Given:
    """The checked arguments of a function, all arrays of numpy or all tensors of torch, and the configuration."""

    def __init__(self, skeleton: Skeleton, values: Replaced | None, **arguments: Numbers):
        slices = coordinate_slices(skeleton)
        n = max((each.stop for each in slices.values()), default=0)
        for k, link in enumerate(skeleton.links):
            if link.vertices is not None:
                raise ValueError(
                    f"link {k} has vertices, whose masses belong to a scene: dynamics in joint coordinates need links with "
                    "all of their mass"
                )
        others = _checked_values(skeleton, values)
        given = [*arguments.values(), *(each for named in others.values() for each in named.values())]
        self._dtype = dtype_like(*given) if any(map(is_tensor, given)) else None
        self.xp: Any = np if self._dtype is None else require_torch("a tensor")
        for name, value in arguments.items():
            unit, shape = ("m/s2", (3,)) if name == "gravity" else ("SI", (n,))
            checked = quantity(name, unit, detached(value), shape)
            setattr(self, name, self._converted(value if is_tensor(value) else checked))
        links = skeleton._links_in_order
        joints = [skeleton._joint_to(link) for link in links]
        own = [
            slices.get(link if joint is None else joint, slice(0, 0))
            for link, joint in zip(links, joints, strict=True)
        ]
        self.configuration = Configuration(
            skeleton,
            [self._link(each, others.get(id(each), {})) for each in links],
            [None if each is None else self._joint(each, others.get(id(each), {})) for each in joints],
            own,
            self.coordinates,
            self.xp,
        )

    coordinates: Computed
    rates: Computed
    accelerations: Computed
    forces: Computed
    gravity: Computed

    def result(self, found: Computed) -> Computed:
        """Return what was found, as a tensor in the dtype of the arguments."""
        return found if self._dtype is None else found.to(self._dtype)

    def _link(self, link: RigidBody, values: Mapping[str, Numbers]) -> LinkNumbers:
        own = {"mass": link.mass or 0.0, "inertia": link.inertia_tensor, "center": or_zero(link.center)}
        found = LinkNumbers(**{name: self._converted(each) for name, each in {**own, **values}.items()})
        inertia = found.inertia
        if inertia.ndim < 2:
            inertia = inertia * self.xp.eye(3, dtype=self.xp.float64)
        return found._replace(inertia=0.5 * (inertia + inertia.T))

    def _joint(self, joint: Joint, values: Mapping[str, Numbers]) -> JointNumbers:
        own = {"origin": joint.origin, "axis": joint.axis, "pitch": joint._pitch}
        found = JointNumbers(**{name: self._converted(each) for name, each in {**own, **values}.items()})
        if "axis" not in values:
            return found
        return found._replace(axis=found.axis / self.xp.sqrt(found.axis @ found.axis))

    def _converted(self, value: Numbers) -> Computed:
        """Return checked numbers as float64 in the module xp, a tensor in its graph."""
        if is_tensor(value):
            return value.to("cpu", self.xp.float64)
        return to_numbers(np.asarray(value, np.float64), self.xp)


def _checked_values(skeleton: Skeleton, values: Replaced | None) -> dict[int, dict[str, Numbers]]:
    """Return the values by the id of their link or joint. Raises ValueError for those that have no effect or are wrong."""
    if values is not None and not isinstance(values, Mapping):
        raise ValueError(
            f"values must be a dictionary {{link or joint: {{name: number}}}}, got {values!r:.60}"
        )
    found: dict[int, dict[str, Numbers]] = {}
    for owner, named in (values or {}).items():
        if not any(owner is each for each in (*skeleton.links, *skeleton.joints)):
            raise ValueError(f"values: {owner!r:.60} is neither a link nor a joint of the skeleton")
        if not isinstance(named, Mapping):
            raise ValueError(
                f"values of {owner!r:.60} must be a dictionary {{name: number}}, got {named!r:.60}"
            )
        for name in named:
            if name not in _names_of(owner):
                known = ", ".join(_names_of(owner)) or "nothing"
                raise ValueError(
                    f"{name} of {owner!r:.60} has no effect on dynamics in joint coordinates, which read {known} of it"
                )
        owner.replaced(**{name: detached(value) for name, value in named.items()})  # checks the numbers
        found[id(owner)] = dict(named)
    return found


def _names_of(owner: RigidBody | Joint) -> tuple[str, ...]:
    """Return the names of the numbers of a link or a joint that its dynamics depend on."""
    if isinstance(owner, RigidBody):
        return "mass", "inertia", "center"
    if isinstance(owner, LoopClosure | Fixed):
        return ()
    if owner._spec.slides:
        return ("axis",)
    return ("origin", *(("axis",) if owner._spec.axis == "required" else ()), *owner._spec.numbers)
