"""What joins two links of a skeleton, or a link and the world, and what acts in there."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from .._checks.owner import Owner
from .._checks.quantity import quantity
from .._checks.scalars import not_negative, positive
from .rigid import Rigid

_FAR = 1e300  # a limit that nothing reaches


class Joint(Owner):
    """Between two links; make one of its subclasses.

    child: the link (Rigid) that it carries. parent: the link that it is fixed to, or None for the world.
    """

    _kind: ClassVar[str] = ""
    _defaults: ClassVar[dict[str, Any]] = {}  # by name: where it does not act

    def __init__(self, child: Rigid, parent: Rigid | None, origin, axis=None, rate=None, **law):
        for name, link in (("child", child), ("parent", parent)):
            if not isinstance(link, Rigid) and (name == "child" or link is not None):
                raise ValueError(f"{name} of a {type(self).__name__} must be a Rigid, got {link!r:.60}")
        if child is parent:
            raise ValueError(f"child and parent of a {type(self).__name__} must be two links")
        self.child, self.parent = child, parent
        self.origin = np.array(quantity("origin", "m", origin, (3,)))
        self.axis = np.zeros(3)
        if axis is not None:
            self.axis = np.array(quantity("axis", "", axis, (3,)))
            length = np.linalg.norm(self.axis)
            if not length > 0:
                raise ValueError("axis must not be zero")
            self.axis /= length
        self._given = {name: value for name, value in law.items() if value is not None}
        for name, value in self._given.items():
            self._given[name] = self._checked(name, value)
        self._check_together()
        self.rate = None if rate is None else self._checked_rate(rate)
        # What it was made without, a solve cannot give it.
        self._replaceable = (
            *self._given,
            *(() if rate is None else ("rate",)),
            *(("origin",) if self.has_place else ()),
        )
        self._in_time = tuple(name for name in type(self)._in_time if name in self._given)

    def __getattr__(self, name: str):
        given = self.__dict__.get("_given", {})
        if name in given:
            return given[name]
        if name in self._defaults:
            return None
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")

    def _checked_rate(self, value) -> float | np.ndarray:
        return float(quantity("rate", f"{self._unit('')}/s", value, ()))

    def _checked(self, name: str, value) -> float | np.ndarray:
        unit = self._unit(name)
        if name in ("servo_stiffness", "torque_limit", "force_limit", "limit_stiffness", "limit_smoothing"):
            return positive(name, unit, value)
        if name in ("spring_stiffness", "damping"):
            return not_negative(name, unit, value)
        return float(quantity(name, unit, value, ()))

    def _unit(self, name: str) -> str:
        slides = self._kind == "prismatic"
        if name == "damping":
            return "N s/m" if slides else "N m s/rad"
        if name in ("spring_stiffness", "servo_stiffness", "limit_stiffness"):
            return "N/m" if slides else "N m/rad"
        if name in ("torque", "torque_limit", "force", "force_limit"):
            return "N" if slides else "N m"
        return "m" if slides else "rad"

    def _check_together(self) -> None:
        given, kind = self._given, type(self).__name__
        limited = [name for name in ("lower_limit", "upper_limit") if name in given]
        if limited and not {"limit_stiffness", "limit_smoothing"} <= given.keys():
            raise ValueError(
                f"a {kind} with {limited[0]} needs limit_stiffness and limit_smoothing, how stiff it is beyond and how soon"
            )
        if len(limited) == 2 and not given["lower_limit"] < given["upper_limit"]:
            raise ValueError(f"lower_limit of a {kind} must be below its upper_limit")
        if self.driven:
            (motor,) = (name for name in given if name.startswith("motor_"))
            if idle := [name for name in _UNDER_MOTOR if name in given]:
                raise ValueError(
                    f"{motor} of a {kind} prescribes where it is: {', '.join(idle)} would do nothing"
                )
        target = [name for name in self._defaults if name.startswith("target_")]
        if target and (target[0] in given) != ("servo_stiffness" in given):
            raise ValueError(
                f"a {kind} that is to follow a target needs both {target[0]} and servo_stiffness"
            )

    @property
    def driven(self) -> bool:
        """Whether a motor prescribes its coordinate."""
        return any(name.startswith("motor_") for name in self._given)

    @property
    def acts(self) -> bool:
        """Whether anything but the constraint itself is in it."""
        return bool(self._given)

    def has(self, name: str) -> bool:
        """Whether it was made with this."""
        return name in self._given

    def replaced(self, **values) -> Joint:
        """The same joint with other numbers of what acts in it."""
        for name in values:
            if name not in self._replaceable:
                raise ValueError(f"the {type(self).__name__} was made without {name}: zero will do")
        own = {name: getattr(self, name) for name in self._replaceable}
        return self._again({**own, **values})

    @property
    def has_place(self) -> bool:
        """Whether it matters where its origin is, and solves may change it."""
        return self._kind in ("revolute", "ball")

    def _again(self, law: dict) -> Joint:
        axis = {"axis": self.axis} if self.axis.any() else {}
        return type(self)(child=self.child, parent=self.parent, **{"origin": self.origin, **axis, **law})

    def add_numbers(self, label: str, values, numbers: dict) -> None:
        if self.acts:
            for name, default in self._defaults.items():
                numbers[label, name] = self._given.get(name, default)
        if self.has_place:
            numbers[label, "origin"] = self.origin

    def gradients(self, label: str, values, gradient) -> dict[str, np.ndarray]:
        found = {name: gradient.value(label, name)[0] for name in self._given}
        if self.has_place:
            found["origin"] = gradient.value(label, "origin")[0]
        if self.rate is not None:
            rows = gradient.others.get("own_velocities")
            found["rate"] = np.zeros(np.shape(self.rate))
            for place in values.moved_by(self) if rows is not None else ():
                moved = rows[place.points]
                found["rate"] = found["rate"] + self._rate_gradient(place.rest, moved)
                if self.has_place:
                    found["origin"] = found["origin"] + np.cross(self._turning, moved).sum(axis=0)
        return found

    def velocities(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) m of what it carries at rest, as it starts: (n, 3) m/s."""
        return self.rate * self._directions(points)

    def _rate_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        return (by_velocities * self._directions(points)).sum()

    @property
    def _turning(self) -> np.ndarray:
        """How fast it turns to start with: (3,) rad/s."""
        return self.rate * self.axis if self._kind == "revolute" else self.rate

    def _directions(self, points: np.ndarray) -> np.ndarray:
        """How points move as its coordinate does: (n, 3), m/rad or 1."""
        if self._kind == "prismatic":
            return np.broadcast_to(self.axis, points.shape)
        return np.cross(self.axis, points - self.origin)

    def __repr__(self) -> str:
        law = "".join(f", {name} {_told(value)}" for name, value in self._given.items())
        return f"{type(self).__name__}({'to the world' if self.parent is None else 'between two links'}{law})"


_UNDER_MOTOR = ("torque", "force", "servo_stiffness", "lower_limit", "upper_limit")


def _told(value) -> str:
    return f"{value:g}" if np.ndim(value) == 0 else f"({', '.join(f'{each:g}' for each in value)})"


class Fixed(Joint):
    """Holds a link to its parent, or to the world: they move as one.

    origin: has no meaning here; by default the world's.

    child, parent: Link objects; without a parent, the world.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> mast = ms.Link(mass=1.0, center=(0, 0, 1.0), inertia=0.1)
    >>> joints = [ms.Ball(bob, origin=(0, 0, 0)), ms.Fixed(mast, bob)]
    >>> ms.Skeleton([bob, mast], joints)
    Skeleton(2 links, 2 joints)
    """

    _kind = "fixed"

    def __init__(self, child: Rigid, parent: Rigid | None = None, origin=(0.0, 0.0, 0.0)):
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
        what it takes, in motions to second order, to first in loops that a Closure closes. In place of a torque, a
        servo and limits. How fast it is to start with, `rate` says.
    rate: rad/s, at the start of a motion from rest positions, in a tree without vertices.

    Solves take another origin too, with the same links at rest. All but the rate and the places may change in ms.simulate,
    one value a step or at the ends of steps.

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
    _replaceable = (*_in_time, "rate", "origin")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin,
        axis,
        spring_stiffness=None,
        rest_angle=None,
        damping=None,
        torque=None,
        motor_angle=None,
        target_angle=None,
        servo_stiffness=None,
        torque_limit=None,
        lower_limit=None,
        upper_limit=None,
        limit_stiffness=None,
        limit_smoothing=None,
        rate=None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Prismatic(Joint):
    """Slides a link along an axis. Its displacement [m] is zero at rest.

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
    _replaceable = (*_in_time, "rate")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin,
        axis,
        spring_stiffness=None,
        rest_displacement=None,
        damping=None,
        force=None,
        motor_displacement=None,
        target_displacement=None,
        servo_stiffness=None,
        force_limit=None,
        lower_limit=None,
        upper_limit=None,
        limit_stiffness=None,
        limit_smoothing=None,
        rate=None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Ball(Joint):
    """Turns a link about a point, any way.

    spring_stiffness: N m/rad, pulls the rotation, as one angle, back to none.
    damping: N m s/rad, a torque against the rate at which the link turns to its parent, in motions.
    torque: (3,) N m, a moment on the child, and against it on the parent, its axes those of the world: it keeps its
        direction as they turn. It has no potential, as a following pressure has none.
    upper_limit, limit_stiffness, limit_smoothing: rad, N m/rad, rad: of that angle, below pi.
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
        "upper_limit": _FAR,
        "limit_stiffness": 0.0,
        "limit_smoothing": 1.0,
    }
    _in_time = tuple(_defaults)
    _replaceable = (*_in_time, "rate", "origin")

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None = None,
        *,
        origin,
        spring_stiffness=None,
        damping=None,
        torque=None,
        upper_limit=None,
        limit_stiffness=None,
        limit_smoothing=None,
        rate=None,
    ):
        law = {name: value for name, value in locals().items() if name in self._defaults}
        super().__init__(child, parent, origin, rate=rate, **law)
        if upper_limit is not None and not 1e-3 <= float(upper_limit) < np.pi:
            raise ValueError(f"upper_limit [rad] of a Ball must be from 1e-3 to pi, got {upper_limit:g}")

    def _checked(self, name: str, value) -> float | np.ndarray:
        if name == "torque":
            return np.array(quantity(name, "N m", value, (3,)))
        return super()._checked(name, value)

    def _checked_rate(self, value) -> np.ndarray:
        return np.array(quantity("rate", "rad/s", value, (3,)))

    def velocities(self, points: np.ndarray) -> np.ndarray:
        return np.cross(self.rate, points - self.origin)

    def _rate_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        return np.cross(points - self.origin, by_velocities).sum(axis=0)


class Closure(Joint):
    """Closes a loop: pulls a point of one link, and the same place on another or in the world, together.

    origin: (3,) m, the place at rest. stiffness: N/m; the gap is the force over it, and `result[closure].gap` says it.

    child, parent: the two links; without a parent, the world.

    >>> import magshell as ms
    >>> a, b = (ms.Link(mass=1.0, center=(x, 0, -1.0), inertia=0.1) for x in (0.0, 1.0))
    >>> hinges = [ms.Revolute(link, origin=(x, 0, 0), axis=(0, 1, 0)) for link, x in ((a, 0.0), (b, 1.0))]
    >>> ms.Skeleton([a, b], [*hinges, ms.Closure(a, b, origin=(0.5, 0, -1.0), stiffness=1e4)])
    Skeleton(2 links, 3 joints)
    """

    _kind = "closure"
    _defaults: ClassVar[dict[str, float]] = {"stiffness": 0.0}
    _replaceable = tuple(_defaults)

    def __init__(self, child: Rigid, parent: Rigid | None = None, *, origin, stiffness):
        super().__init__(child, parent, origin, stiffness=positive("stiffness", "N/m", stiffness))
