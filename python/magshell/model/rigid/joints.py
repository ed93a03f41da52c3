"""Defines joints: what all have in common, and each kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity
from ..._input.scalars import not_negative, positive
from .joint_table import JOINTS, JointSpec
from .rigid import RigidBody

if TYPE_CHECKING:
    from ..._input.kinds import Numbers


class Joint(Owner):
    """A joint between two links; make one of its subclasses.

    child: the link (RigidBody) that it carries. parent: the link that it is fixed to, or None for the world.
    """

    child: RigidBody
    parent: RigidBody | None

    _spec: ClassVar[JointSpec] = JointSpec("")

    def __init__(
        self,
        child: RigidBody,
        parent: RigidBody | None,
        origin: Numbers,
        axis: Numbers | None = None,
        rate: Numbers | None = None,
        **law: Any,
    ):
        for name, link in (("child", child), ("parent", parent)):
            if not isinstance(link, RigidBody) and (name == "child" or link is not None):
                raise ValueError(f"{name} of a {type(self).__name__} must be a RigidBody, got {link!r:.60}")
        if child is parent:
            raise ValueError(f"child and parent of a {type(self).__name__} must be two links")
        self.child, self.parent = child, parent
        self.origin: np.ndarray = np.array(quantity("origin", "m", origin, (3,)))
        self.axis: np.ndarray = np.zeros(3)
        self._axis_length = 1.0  # of what was given
        if axis is not None:
            along = quantity("axis", "", axis, (3,))
            self._axis_length = np.linalg.norm(along)
            if not self._axis_length > 0:
                raise ValueError("axis must not be zero")
            self.axis = along / self._axis_length
        for name in self._spec.numbers:
            setattr(self, name, self._checked(name, law.pop(name)))
        self._given = {name: self._checked(name, value) for name, value in law.items() if value is not None}
        self._check_together()
        self.rate: float | np.ndarray | None = None if rate is None else self._checked_rate(rate)
        # A solve can replace only the numbers with which the joint was made.
        self._replaceable = (
            *self._given,
            *(() if rate is None else ("rate",)),
            *self._geometry,
        )
        self._in_time = tuple(name for name in type(self)._in_time if name in self._given)

    @property
    def _kind(self) -> str:
        return self._spec.kind

    def _unit(self, name: str) -> str:
        return self._spec.unit(name)

    def __getattr__(self, name: str) -> Any:
        given = self.__dict__.get("_given", {})
        if name in given:
            return given[name]
        if name in self._spec.defaults:
            return None
        raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")

    def _checked_rate(self, value) -> float | np.ndarray:
        return float(quantity("rate", f"{self._spec.unit('')}/s", value, ()))

    def _checked(self, name: str, value) -> float | np.ndarray:
        unit = self._spec.unit(name)
        if name in self._spec.vectors:
            return np.array(quantity(name, unit, value, (3,)))
        if name in ("servo_stiffness", "torque_limit", "force_limit", "limit_stiffness", "limit_smoothing"):
            return positive(name, unit, value)
        if name in ("spring_stiffness", "damping"):
            return not_negative(name, unit, value)
        return float(quantity(name, unit, value, ()))

    def _check_together(self) -> None:
        given, kind = self._given, type(self).__name__
        limited = [name for name in ("lower_limit", "upper_limit", "cone_limit") if name in given]
        if limited and not {"limit_stiffness", "limit_smoothing"} <= given.keys():
            raise ValueError(
                f"a {kind} with {limited[0]} needs limit_stiffness and limit_smoothing, how stiff it is beyond and how soon"
            )
        if "lower_limit" in given and not given["lower_limit"] < given.get("upper_limit", np.inf):
            raise ValueError(f"lower_limit of a {kind} must be below its upper_limit")
        if self._driven:
            motor = self._spec.motor
            if idle := [name for name in _UNDER_MOTOR if name in given]:
                raise ValueError(
                    f"{motor} of a {kind} prescribes where it is: {', '.join(idle)} would do nothing"
                )
        target = [name for name in self._spec.defaults if name.startswith("target_")]
        if target and (target[0] in given) != ("servo_stiffness" in given):
            raise ValueError(
                f"a {kind} that is to follow a target needs both {target[0]} and servo_stiffness"
            )

    @property
    def _driven(self) -> bool:  # plain-words: ok
        """Return whether a motor prescribes its coordinate."""
        return self._spec.motor in self._given

    @property
    def _acts(self) -> bool:
        """Return whether it has springs, torques, limits or a motor, besides the constraint itself."""
        return bool(self._given)

    @property
    def _resting(self) -> Joint:
        """Return the joint without the parts that act at rest.

        These are torques, springs and servos with another rest value, and limits that the rest value exceeds.
        """
        pulls = {name for name in self._given if name in _PULLS and np.any(self._given[name])}
        beyond = {"lower_limit": -1.0, "upper_limit": 1.0}
        pulls |= {name for name, way in beyond.items() if way * self._given.get(name, way) < 0}
        return self.replaced(**{name: self._spec.defaults[name] for name in pulls}) if pulls else self

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if values over time, (n, ...), contain one that the joint cannot have."""
        if rows.ndim == 1:
            for extreme in np.unique([rows.min(), rows.max()]):
                self._checked(name, extreme)

    def _has(self, name: str) -> bool:
        """Return whether it was made with this number."""
        return name in self._given

    def replaced(self, **values: Any) -> Joint:
        """Return the same joint with other numbers. Raises ValueError for one with which it was not made."""
        for name in values:
            if name not in self._replaceable:
                raise ValueError(f"the {type(self).__name__} was made without {name}: zero will do")
        own = {name: getattr(self, name) for name in self._replaceable}
        return self._again({**own, **values})

    @property
    def _has_axis(self) -> bool:
        """Return whether it was made with an axis."""
        return bool(self.axis.any())

    @property
    def _geometry(self) -> tuple[str, ...]:
        """The names of the numbers that say where it is at rest."""
        return ("origin", *(("axis",) if self._has_axis else ()), *self._spec.numbers)

    def _again(self, law: dict[Any, Any]) -> Joint:
        own = {name: getattr(self, name) for name in self._geometry}
        return type(self)(child=self.child, parent=self.parent, **{**own, **law})

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        if self._acts:
            for name, default in self._spec.defaults.items():
                numbers[label, name] = self._given.get(name, default)
        for name in self._geometry:
            numbers[label, name] = getattr(self, name)

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        found = {name: gradient.value(label, name)[0] for name in (*self._given, *self._geometry)}
        if self.rate is not None:
            rows = gradient.others.get("own_velocities")
            found["rate"] = np.zeros(np.shape(self.rate))
            for place in values.moved_by(self) if rows is not None else ():
                moved = rows[place.points]
                found["rate"] = found["rate"] + self._rate_gradient(place.rest, moved)
                if not self._spec.slides:
                    found["origin"] = found["origin"] + np.cross(self._turning, moved).sum(axis=0)
                if self._has_axis and self._spec.freedoms == 1:
                    found["axis"] = found["axis"] + self._axis_gradient(place.rest, moved)
                if "pitch" in found:
                    found["pitch"] = found["pitch"] + self.rate * self.axis @ moved.sum(axis=0)
        if self._has_axis:  # of a unit vector along what was given
            across = found["axis"] - self.axis * (self.axis @ found["axis"])
            found["axis"] = across / self._axis_length
        return found

    def velocities(self, points: np.ndarray) -> np.ndarray:
        """Return the velocities at the start of points (n, 3) m of its child at rest, (n, 3) m/s."""
        return self.rate * self._directions(points)

    def _rate_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        return (by_velocities * self._directions(points)).sum()

    def _axis_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        if self._spec.slides:
            return self.rate * by_velocities.sum(axis=0)
        arms = np.cross(points - self.origin, by_velocities) + self._pitch * by_velocities
        return self.rate * arms.sum(axis=0)

    @property
    def _pitch(self) -> float:
        """Return how far it slides per angle, m/rad: zero but for screws."""
        return getattr(self, "pitch", 0.0)

    def _slid_by(self, rotation: np.ndarray, slid: float) -> float:
        """Return how far the child slides along the axis if it is rotated by a matrix (3, 3), m: zero but for screws.

        slid: about how far it slides, m, which tells the full turns.
        """
        return 0.0

    @property
    def _turning(self) -> np.ndarray:
        """Return the angular velocity with which it starts, (3,) rad/s."""
        return self.rate * self.axis if self._spec.freedoms == 1 else self.rate

    def _directions(self, points: np.ndarray) -> np.ndarray:
        """Return the derivative of points (n, 3) m by its coordinate, (n, 3) m/rad or 1."""
        if self._spec.slides:
            return np.broadcast_to(self.axis, points.shape)
        return np.cross(self.axis, points - self.origin) + self._pitch * self.axis

    def __repr__(self) -> str:
        law = "".join(f", {name} {_format_number(value)}" for name, value in self._given.items())
        return f"{type(self).__name__}({'to the world' if self.parent is None else 'between two links'}{law})"


_PULLS = (
    "torque",
    "force",
    "rest_angle",
    "rest_displacement",
    "target_angle",
    "target_displacement",
    "target_rotation",
)
_UNDER_MOTOR = ("torque", "force", "servo_stiffness", "lower_limit", "upper_limit", "cone_limit")


def _format_number(value) -> str:
    return f"{value:g}" if np.ndim(value) == 0 else f"({', '.join(f'{each:g}' for each in value)})"


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

    _spec = JOINTS["fixed"]
    _replaceable = _spec.replaceable

    def __init__(self, child: RigidBody, parent: RigidBody | None = None, origin: Numbers = (0.0, 0.0, 0.0)):
        super().__init__(child, parent, origin)


class Revolute(Joint):
    """Turns a link about an axis: a hinge. Its angle is zero at rest, and counts full turns.

    origin, axis: a point on the axis (3,) m and its direction (3,) of any length, in the world at rest; the axis moves with
        the parent.
    spring_stiffness, rest_angle: N m/rad and rad, of a spring.
    damping: N m s/rad, of a torque against the rate of the angle, in motions.
    torque: N m, about the axis on the child; the parent feels the opposite torque.
    target_angle, servo_stiffness, torque_limit: rad, N m/rad and N m, of a servo whose torque pulls towards the target and
        stays below the limit (no limit by default).
    lower_limit, upper_limit, limit_stiffness, limit_smoothing: rad, rad, N m/rad and rad. Beyond a limit, a torque grows
        like a parabola over the length of the smoothing, then linearly with the stiffness.
    motor_angle: rad, the angle that a motor prescribes, reached by the shorter way round; it excludes a torque, a servo and
        limits. `result[hinge].motor_torque` is the torque of the motor. In motions by TRBDF2 it is of second order in the
        time step if the angle is a function of the time, and of first order if it is an array, whose rate is one a step.
    rate: rad/s, the rate of the angle at the start of a motion from rest positions, in a tree without vertices.

    A solve may replace all of them, the links being the same at rest. The gradient with respect to the axis is
    perpendicular to it, as its length has no effect. All but the rate, origin and axis may change in ms.simulate, with
    one value for each step or for the ends of all steps.

    >>> import numpy as np
    >>> import magshell as ms
    >>> rod = ms.RigidBody(mass=1.0, inertia=1 / 12, center=(0.5, 0, 0))
    >>> hinge = ms.Revolute(rod, origin=(0, 0, 0), axis=(0, 1, 0))
    >>> scene = ms.Scene(ms.Skeleton([rod], [hinge]), gravity=(0, 0, -9.81))
    >>> move = ms.simulate(scene, steps=100, time_step=5e-3)
    >>> bool(abs(np.linalg.norm(move[rod].center[-1]) - 0.5) < 1e-12)
    True
    """

    _spec = JOINTS["revolute"]
    _in_time = tuple(_spec.defaults)
    _replaceable = _spec.replaceable

    def __init__(
        self,
        child: RigidBody,
        parent: RigidBody | None = None,
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
        law = {name: value for name, value in locals().items() if name in self._spec.defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Screw(Joint):
    """Turns a link about an axis and slides it along the axis at a fixed ratio: a nut on a lead screw.

    pitch: m/rad, the displacement per angle, which is the lead over 2 pi; not zero, and negative for a left-handed thread. A
        solve may replace it.

    child, parent, origin, axis and the numbers of springs, dampers, torques, servos, limits and motors: as in Revolute, in
    terms of the angle. The angle counts full turns, and so do the targets of motors, which do not take the shorter way. A
    force F along the axis acts as the torque pitch F. `result[screw]` has an angle and a displacement.

    >>> import math
    >>> import magshell as ms
    >>> nut = ms.Link(mass=1.0, inertia=0.1, center=(0, 0, 0))
    >>> pitch = 2e-3 / (2 * math.pi)
    >>> screw = ms.Screw(nut, origin=(0, 0, 0), axis=(0, 0, 1), pitch=pitch, motor_angle=20.0)
    >>> rest = ms.equilibrium(ms.Scene(ms.Skeleton([nut], [screw]), gravity=(0, 0, -9.81)))
    >>> print(f"{rest[screw].displacement:.6f} m, {rest[screw].motor_torque:.6f} N m")
    0.006366 m, 0.003123 N m
    """

    _spec = JOINTS["screw"]
    _in_time = tuple(_spec.defaults)
    _replaceable = _spec.replaceable

    def __init__(
        self,
        child: RigidBody,
        parent: RigidBody | None = None,
        *,
        origin: Numbers,
        axis: Numbers,
        pitch: Numbers,
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
        law = {name: value for name, value in locals().items() if name in self._spec.defaults}
        super().__init__(child, parent, origin, axis, rate, pitch=pitch, **law)

    def _checked(self, name: str, value) -> float | np.ndarray:
        checked = super()._checked(name, value)
        if name == "pitch" and checked == 0.0:
            raise ValueError("pitch of a Screw must not be zero: a Revolute only turns")
        return checked

    def _slid_by(self, rotation: np.ndarray, slid: float) -> float:
        sines = np.array(
            [
                rotation[2, 1] - rotation[1, 2],
                rotation[0, 2] - rotation[2, 0],
                rotation[1, 0] - rotation[0, 1],
            ]
        )
        turned, angle = np.arctan2(self.axis @ sines, np.trace(rotation) - 1.0), slid / self.pitch
        return self.pitch * (angle + np.remainder(turned - angle + np.pi, 2.0 * np.pi) - np.pi)


class Prismatic(Joint):
    """Slides a link along an axis. Its displacement [m] is zero at rest; nothing depends on where its origin is.

    Its numbers are those of Revolute, with displacements for angles and forces for torques: spring_stiffness N/m,
    rest_displacement m, damping N s/m, force N, motor_displacement m (`result[slide].motor_force`), target_displacement m,
    servo_stiffness N/m, force_limit N, lower_limit, upper_limit m, limit_stiffness N/m, limit_smoothing m, rate m/s.

    child, parent, origin, axis: as in Revolute.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> ms.Skeleton([bob], [ms.Prismatic(bob, origin=(0, 0, 0), axis=(0, 0, 1), spring_stiffness=100.0)])
    Skeleton(1 link, 1 joint)
    """

    _spec = JOINTS["prismatic"]
    _in_time = tuple(_spec.defaults)
    _replaceable = _spec.replaceable

    def __init__(
        self,
        child: RigidBody,
        parent: RigidBody | None = None,
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
        law = {name: value for name, value in locals().items() if name in self._spec.defaults}
        super().__init__(child, parent, origin, axis, rate, **law)


class Ball(Joint):
    """Turns a link about a point, about any axis: a ball joint.

    origin: the point (3,) m, in the world at rest; it moves with the parent.
    spring_stiffness: N m/rad, of a spring that turns the angle of the rotation back to zero.
    damping: N m s/rad, of a torque against the angular velocity of the child relative to the parent, in motions.
    torque: (3,) N m in the world's axes, on the child; the parent feels the opposite torque. It keeps its direction as they
        turn, and therefore has no potential.
    motor_rotation: the rotation from the parent to the child that a motor prescribes, reached by the shorter way round: a
        rotation vector (3,) rad in axes that are those of the world at rest and move with the parent.
        `result[ball].motor_torque` (3,) is the torque of the motor, as in Revolute.
    target_rotation, servo_stiffness, torque_limit: a rotation vector (3,) rad as above, N m/rad and N m, of a servo whose
        torque turns the child to the target about one axis and stays below the limit (no limit by default). For a
        target half a turn away this axis does not exist.
    upper_limit: rad, of the angle of the rotation, from 1e-3 to below pi.
    axis, cone_limit: a direction (3,) in the world at rest, and the largest angle, rad from 1e-3 to below pi, between this
        direction on the child and on the parent. It limits the swing; the twist about the direction is free.
    limit_stiffness, limit_smoothing: N m/rad and rad, of these two limits, as in Revolute.
    rate: (3,) rad/s in the world's axes, the angular velocity of the child relative to the parent at the start of a
    motion, as
        in Revolute.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> ms.Skeleton([bob], [ms.Ball(bob, origin=(0, 0, 0))])
    Skeleton(1 link, 1 joint)
    """

    _spec = JOINTS["ball"]
    _in_time = tuple(_spec.defaults)
    _replaceable = _spec.replaceable

    def __init__(
        self,
        child: RigidBody,
        parent: RigidBody | None = None,
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
        law = {name: value for name, value in locals().items() if name in self._spec.defaults}
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


class LoopClosure(Joint):
    """Closes a loop: a spring pulls a point of one link to the same point on another link, or in the world.

    origin: the point at rest, (3,) m, which a solve may replace. stiffness: of the spring, N/m. A gap remains, which is the
        force over the stiffness: `result[closure].gap`.

    child, parent: the two links; without a parent, the world.

    >>> import magshell as ms
    >>> a, b = (ms.Link(mass=1.0, center=(x, 0, -1.0), inertia=0.1) for x in (0.0, 1.0))
    >>> hinges = [ms.Revolute(link, origin=(x, 0, 0), axis=(0, 1, 0)) for link, x in ((a, 0.0), (b, 1.0))]
    >>> ms.Skeleton([a, b], [*hinges, ms.LoopClosure(a, b, origin=(0.5, 0, -1.0), stiffness=1e4)])
    Skeleton(2 links, 3 joints)
    """

    _spec = JOINTS["closure"]
    _replaceable = _spec.replaceable

    def __init__(
        self, child: RigidBody, parent: RigidBody | None = None, *, origin: Numbers, stiffness: Numbers
    ):
        super().__init__(child, parent, origin, stiffness=positive("stiffness", "N/m", stiffness))
