"""The kinds of joints of a skeleton."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .._checks.quantity import quantity
from .._checks.scalars import positive
from .joint import Joint
from .rigid import Rigid

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


_FAR = 1e300  # a limit that nothing reaches


class Fixed(Joint):
    """Holds a link to its parent, or to the world: they move as one.

    origin: where it is drawn; nothing depends on it. By default the world's.

    child, parent: Link objects; without a parent, the world.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> mast = ms.Link(mass=1.0, center=(0, 0, 1.0), inertia=0.1)
    >>> joints = [ms.Ball(bob, origin=(0, 0, 0)), ms.Fixed(mast, bob)]
    >>> ms.Skeleton([bob, mast], joints)
    Skeleton(2 links, 2 joints)
    """

    _kind = "fixed"
    _replaceable = ("origin",)

    def __init__(self, child: Rigid, parent: Rigid | None = None, origin: Numbers = (0.0, 0.0, 0.0)):
        super().__init__(child, parent, origin)


class Revolute(Joint):
    """Turns a link about an axis: a hinge. Its angle is zero at rest, and counts full turns.

    origin, axis: (3,) m, and a direction, both in the world at rest and riding on the parent.
    spring_stiffness, rest_angle: N m/rad, rad: a spring.
    damping: N m s/rad, a torque against the rate of the angle, in motions.
    torque: N m, on the child about the axis, and on the parent against it.
    target_angle, servo_stiffness, torque_limit: rad, N m/rad, N m: a servo that pulls towards the target, with a torque
        that stays below the limit (none by default).
    lower_limit, upper_limit, limit_stiffness, limit_smoothing: rad, rad, N m/rad, rad: beyond a limit the torque grows by
        a parabola of the length of the smoothing, then at this stiffness.
    motor_angle: rad, prescribes the angle: a motor, reached by the shorter way round; `result[hinge].motor_torque` says
        what it takes, in motions to second order. In place of a torque, a servo and limits. How fast it is to start with,
        `rate` says.
    rate: rad/s, at the start of a motion from rest positions, in a tree without vertices.

    Solves take another origin and axis too, with the same links at rest. An axis may have any length, which changes
    nothing, so that a gradient by it is across the axis. All but the rate and the places may change in ms.simulate, one
    value a step or at the ends of steps.

    >>> import numpy as np
    >>> import magshell as ms
    >>> rod = ms.Rigid(mass=1.0, inertia=1 / 12, center=(0.5, 0, 0))
    >>> hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0))
    >>> scene = ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -9.81))
    >>> move = ms.simulate(scene, steps=100, time_step=5e-3)
    >>> bool(abs(np.linalg.norm(move[rod].center[-1]) - 0.5) < 1e-12)
    True
    """

    _kind = "revolute"
    _defaults: ClassVar[dict[str, float]] = {
        "spring_stiffness": 0.0,
        "rest_angle": 0.0,
        "damping": 0.0,
        "torque": 0.0,
        "motor_angle": 0.0,
        "target_angle": 0.0,
        "servo_stiffness": 0.0,
        "torque_limit": _FAR,
        "lower_limit": -_FAR,
        "upper_limit": _FAR,
        "limit_stiffness": 0.0,
        "limit_smoothing": 1.0,
    }
    _in_time = tuple(_defaults)
    _replaceable = (*_in_time, "rate", "origin", "axis")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin: Numbers,
        axis: Numbers,
        spring_stiffness: Numbers | None = None,
        rest_angle: Numbers | None = None,
        damping: Numbers | None = None,
        torque: Numbers | None = None,
        motor_angle: Numbers | None = None,
        target_angle: Numbers | None = None,
        servo_stiffness: Numbers | None = None,
        torque_limit: Numbers | None = None,
        lower_limit: Numbers | None = None,
        upper_limit: Numbers | None = None,
        limit_stiffness: Numbers | None = None,
        limit_smoothing: Numbers | None = None,
        rate: Numbers | None = None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Prismatic(Joint):
    """Slides a link along an axis. Its displacement [m] is zero at rest; nothing depends on where its origin is.

    As Revolute, with lengths for angles and forces [N] for torques: spring_stiffness N/m, rest_displacement m, damping
    N s/m, force N, motor_displacement m (`result[slide].motor_force`), target_displacement m, servo_stiffness N/m,
    force_limit N, lower_limit, upper_limit m, limit_stiffness N/m,
    limit_smoothing m, rate m/s.

    child, parent, origin, axis: as in Revolute.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> ms.Skeleton([bob], [ms.Prismatic(bob, origin=(0, 0, 0), axis=(0, 0, 1), spring_stiffness=100.0)])
    Skeleton(1 link, 1 joint)
    """

    _kind = "prismatic"
    _defaults: ClassVar[dict[str, float]] = {
        "spring_stiffness": 0.0,
        "rest_displacement": 0.0,
        "damping": 0.0,
        "force": 0.0,
        "motor_displacement": 0.0,
        "target_displacement": 0.0,
        "servo_stiffness": 0.0,
        "force_limit": _FAR,
        "lower_limit": -_FAR,
        "upper_limit": _FAR,
        "limit_stiffness": 0.0,
        "limit_smoothing": 1.0,
    }
    _in_time = tuple(_defaults)
    _replaceable = (*_in_time, "rate", "origin", "axis")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin: Numbers,
        axis: Numbers,
        spring_stiffness: Numbers | None = None,
        rest_displacement: Numbers | None = None,
        damping: Numbers | None = None,
        force: Numbers | None = None,
        motor_displacement: Numbers | None = None,
        target_displacement: Numbers | None = None,
        servo_stiffness: Numbers | None = None,
        force_limit: Numbers | None = None,
        lower_limit: Numbers | None = None,
        upper_limit: Numbers | None = None,
        limit_stiffness: Numbers | None = None,
        limit_smoothing: Numbers | None = None,
        rate: Numbers | None = None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Ball(Joint):
    """Turns a link about a point, any way.

    origin: (3,) m, that point, in the world at rest and riding on the parent.
    spring_stiffness: N m/rad, pulls the rotation, as one angle, back to none.
    damping: N m s/rad, a torque against the rate at which the link turns to its parent, in motions.
    torque: (3,) N m, a moment on the child, and against it on the parent, its axes those of the world: it keeps its
        direction as they turn. It has no potential, as a following pressure has none.
    motor_rotation: (3,) rad, prescribes the rotation from the parent to the child as a rotation vector, whose axes are those
        of the world at rest and ride on the parent: a motor, reached by the shorter way round.
        `result[ball].motor_torque` is the moment (3,) that it takes, as in Revolute.
    target_rotation, servo_stiffness, torque_limit: (3,) rad likewise, N m/rad, N m: a servo that turns to the target along
        one axis, with a torque that stays below the limit (none by default). A target half a turn away has no such axis.
    upper_limit: rad, of the angle of the rotation, from 1e-3 to below pi.
    axis, cone_limit: (3,), a direction in the world at rest, and rad, from 1e-3 to below pi: how far the direction may be
        off on the child from where it is on the parent: the swing, whatever the twist about it.
    limit_stiffness, limit_smoothing: N m/rad, rad: of these two limits, as in Revolute.
    rate: (3,) rad/s, how the child turns to its parent at the start of a motion, as in Revolute; axes of the world.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> ms.Skeleton([bob], [ms.Ball(bob, origin=(0, 0, 0))])
    Skeleton(1 link, 1 joint)
    """

    _kind = "ball"
    _defaults: ClassVar[dict[str, Any]] = {
        "spring_stiffness": 0.0,
        "damping": 0.0,
        "torque": np.zeros(3),
        "motor_rotation": np.zeros(3),
        "target_rotation": np.zeros(3),
        "servo_stiffness": 0.0,
        "torque_limit": _FAR,
        "upper_limit": _FAR,
        "cone_limit": _FAR,
        "limit_stiffness": 0.0,
        "limit_smoothing": 1.0,
    }
    _vectors: ClassVar[dict[str, str]] = {"torque": "N m", "motor_rotation": "rad", "target_rotation": "rad"}
    _in_time = tuple(_defaults)
    _replaceable = (*_in_time, "rate", "origin", "axis")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin: Numbers,
        axis: Numbers | None = None,
        spring_stiffness: Numbers | None = None,
        damping: Numbers | None = None,
        torque: Numbers | None = None,
        motor_rotation: Numbers | None = None,
        target_rotation: Numbers | None = None,
        servo_stiffness: Numbers | None = None,
        torque_limit: Numbers | None = None,
        upper_limit: Numbers | None = None,
        cone_limit: Numbers | None = None,
        limit_stiffness: Numbers | None = None,
        limit_smoothing: Numbers | None = None,
        rate: Numbers | None = None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, axis, rate, **law)
        if (axis is None) != (cone_limit is None):
            raise ValueError("a Ball that is to stay in a cone needs both axis and cone_limit")

    def _checked(self, name: str, value) -> float | np.ndarray:
        checked = super()._checked(name, value)
        if name in ("upper_limit", "cone_limit") and not 1e-3 <= checked < np.pi:
            raise ValueError(f"{name} [rad] of a Ball must be from 1e-3 to pi, got {checked:g}")
        return checked

    def _checked_rate(self, value) -> np.ndarray:
        return np.array(quantity("rate", "rad/s", value, (3,)))

    def velocities(self, points: np.ndarray) -> np.ndarray:
        return np.cross(self.rate, points - self.origin)

    def _rate_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        return np.cross(points - self.origin, by_velocities).sum(axis=0)


class Closure(Joint):
    """Closes a loop: pulls a point of one link, and the same place on another or in the world, together.

    origin: (3,) m, the place at rest, which solves may change. stiffness: N/m; the gap is the force over it, and
        `result[closure].gap` says it.

    child, parent: the two links; without a parent, the world.

    >>> import magshell as ms
    >>> a, b = (ms.Link(mass=1.0, center=(x, 0, -1.0), inertia=0.1) for x in (0.0, 1.0))
    >>> hinges = [ms.Revolute(link, origin=(x, 0, 0), axis=(0, 1, 0)) for link, x in ((a, 0.0), (b, 1.0))]
    >>> ms.Skeleton([a, b], [*hinges, ms.Closure(a, b, origin=(0.5, 0, -1.0), stiffness=1e4)])
    Skeleton(2 links, 3 joints)
    """

    _kind = "closure"
    _defaults: ClassVar[dict[str, float]] = {"stiffness": 0.0}
    _replaceable = (*_defaults, "origin")

    def __init__(self, child: Rigid, parent: Rigid | None = None, *, origin: Numbers, stiffness: Numbers):
        super().__init__(child, parent, origin, stiffness=positive("stiffness", "N/m", stiffness))
