"""What joins two links of a skeleton, or a link and the world, and what acts in there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from .._checks.owner import Owner
from .._checks.quantity import quantity
from .._checks.scalars import not_negative, positive
from .rigid import Rigid

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


class Joint(Owner):
    """Between two links; make one of its subclasses.

    child: the link (Rigid) that it carries. parent: the link that it is fixed to, or None for the world.
    """

    child: Rigid
    parent: Rigid | None

    _kind: ClassVar[str] = ""
    _defaults: ClassVar[dict[str, Any]] = {}  # by name: where it does not act
    _vectors: ClassVar[dict[str, str]] = {}  # the units of those that have three numbers

    def __init__(
        self,
        child: Rigid,
        parent: Rigid | None,
        origin: Numbers,
        axis: Numbers | None = None,
        rate: Numbers | None = None,
        **law: Any,
    ):
        for name, link in (("child", child), ("parent", parent)):
            if not isinstance(link, Rigid) and (name == "child" or link is not None):
                raise ValueError(f"{name} of a {type(self).__name__} must be a Rigid, got {link!r:.60}")
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
        self._given = {name: self._checked(name, value) for name, value in law.items() if value is not None}
        self._check_together()
        self.rate: float | np.ndarray | None = None if rate is None else self._checked_rate(rate)
        # What it was made without, a solve cannot give it.
        self._replaceable = (
            *self._given,
            *(() if rate is None else ("rate",)),
            *self._places,
        )
        self._in_time = tuple(name for name in type(self)._in_time if name in self._given)

    def __getattr__(self, name: str) -> Any:
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
        if name in self._vectors:
            return np.array(quantity(name, unit, value, (3,)))
        if name in ("servo_stiffness", "torque_limit", "force_limit", "limit_stiffness", "limit_smoothing"):
            return positive(name, unit, value)
        if name in ("spring_stiffness", "damping"):
            return not_negative(name, unit, value)
        return float(quantity(name, unit, value, ()))

    def _unit(self, name: str) -> str:
        slides = self._kind == "prismatic"
        if name in self._vectors:
            return self._vectors[name]
        if name == "damping":
            return "N s/m" if slides else "N m s/rad"
        if name in ("spring_stiffness", "servo_stiffness", "limit_stiffness"):
            return "N/m" if slides else "N m/rad"
        if name in ("torque", "torque_limit", "force", "force_limit"):
            return "N" if slides else "N m"
        return "m" if slides else "rad"

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
    def _driven(self) -> bool:
        """Whether a motor prescribes its coordinate."""
        return any(name.startswith("motor_") for name in self._given)

    @property
    def _acts(self) -> bool:
        """Whether anything but the constraint itself is in it."""
        return bool(self._given)

    @property
    def _resting(self) -> Joint:
        """Itself without what pulls at rest: torques, springs and servos that want something else, limits beyond it."""
        pulls = {name for name in self._given if name in _PULLS and np.any(self._given[name])}
        beyond = {"lower_limit": -1.0, "upper_limit": 1.0}
        pulls |= {name for name, way in beyond.items() if way * self._given.get(name, way) < 0}
        return self.replaced(**{name: self._defaults[name] for name in pulls}) if pulls else self

    def _has(self, name: str) -> bool:
        """Whether it was made with this."""
        return name in self._given

    def replaced(self, **values: Any) -> Joint:
        """The same joint with other numbers of what acts in it."""
        for name in values:
            if name not in self._replaceable:
                raise ValueError(f"the {type(self).__name__} was made without {name}: zero will do")
        own = {name: getattr(self, name) for name in self._replaceable}
        return self._again({**own, **values})

    @property
    def _has_axis(self) -> bool:
        """Whether it was made with one."""
        return bool(self.axis.any())

    @property
    def _places(self) -> tuple[str, ...]:
        """What of it says where it is at rest."""
        return ("origin", "axis") if self._has_axis else ("origin",)

    def _again(self, law: dict[Any, Any]) -> Joint:
        own = {name: getattr(self, name) for name in self._places}
        return type(self)(child=self.child, parent=self.parent, **{**own, **law})

    def _add_numbers(self, label: str, values: Any, numbers: dict[Any, Any]) -> None:
        if self._acts:
            for name, default in self._defaults.items():
                numbers[label, name] = self._given.get(name, default)
        for name in self._places:
            numbers[label, name] = getattr(self, name)

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        found = {name: gradient.value(label, name)[0] for name in (*self._given, *self._places)}
        if self.rate is not None:
            rows = gradient.others.get("own_velocities")
            found["rate"] = np.zeros(np.shape(self.rate))
            for place in values.moved_by(self) if rows is not None else ():
                moved = rows[place.points]
                found["rate"] = found["rate"] + self._rate_gradient(place.rest, moved)
                if self._kind != "prismatic":
                    found["origin"] = found["origin"] + np.cross(self._turning, moved).sum(axis=0)
                if self._has_axis and self._kind != "ball":
                    found["axis"] = found["axis"] + self._axis_gradient(place.rest, moved)
        if self._has_axis:  # of a unit vector along what was given
            across = found["axis"] - self.axis * (self.axis @ found["axis"])
            found["axis"] = across / self._axis_length
        return found

    def velocities(self, points: np.ndarray) -> np.ndarray:
        """Of points (n, 3) m of what it carries at rest, as it starts: (n, 3) m/s."""
        return self.rate * self._directions(points)

    def _rate_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        return (by_velocities * self._directions(points)).sum()

    def _axis_gradient(self, points: np.ndarray, by_velocities: np.ndarray) -> np.ndarray:
        slides = self._kind == "prismatic"
        arms = by_velocities if slides else np.cross(points - self.origin, by_velocities)
        return self.rate * arms.sum(axis=0)

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


def _told(value) -> str:
    return f"{value:g}" if np.ndim(value) == 0 else f"({', '.join(f'{each:g}' for each in value)})"
