"""Values of a scene's objects over the time of a motion: arrays at the ends of steps, and functions of the time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import shape_of
from ..._runtime.keywords import nearest_first
from ..actuators.actuator import Actuator
from ..contact.obstacles import Obstacle
from ..fields.field import AppliedField
from ..rigid.joints import Joint
from ..shells.shell import UNITS as _GROWTH_UNITS
from ..shells.shell import Shell
from ..supports.supports import Support

if TYPE_CHECKING:
    from .scene import Scene

_JUMPING = (AppliedField, Joint, Actuator, Shell)  # their values may change at once, others move


@dataclass(frozen=True)
class Course:
    """A value as a caller gives it over time. row: its shape at one time."""

    owner: Any
    name: str
    unit: str
    value: Any
    row: tuple[int, ...]

    def check(self, steps: int) -> None:
        """Raises ValueError unless it is a function, or numbers for every end of a step; fields may change at once."""
        if callable(self.value):
            return
        shape = shape_of(self._label, self.value)
        if shape == self.row:
            return
        allowed = {"(steps + 1, ...)": (steps + 1, *self.row)}
        if changes_at_once(self.owner):
            allowed["(steps, ...)"] = (steps, *self.row)
        if shape not in allowed.values():
            wanted = " or ".join(f"{name} = {each}" for name, each in allowed.items())
            why = ", as one a step would have it jump" if shape == (steps, *self.row) else ""
            raise ValueError(
                f"{self._label} must have shape {self.row}, or {wanted} to move in time{why}, or be a function of the "
                f"time; got {shape}"
            )

    @property
    def _label(self) -> str:
        return f"{self.name} [{self.unit}] of {type(self.owner).__name__}"


def _unit(owner, name: str) -> str:
    return owner._unit(name) if isinstance(owner, Joint | Actuator) else _UNITS[name]


_UNITS = {
    "positions": "m",
    "moments": "A m^2",
    "remanent_magnetization": "A/m",
    "center": "m",
    "rotation": "rad",
    "displacement": "m",
    "pressure": "Pa",
    **_GROWTH_UNITS,
}


def over_time(
    scene: Scene, replaced: dict[object, dict[Any, Any]]
) -> tuple[dict[object, dict[Any, Any]], list[Course]]:
    """What of the values of a solve is the same all the time, and what is not. Raises ValueError on what cannot change."""
    still: dict[object, dict[Any, Any]] = {}
    courses: list[Course] = []
    for owner, named in replaced.items():
        for name, value in named.items():
            row = row_in_time(owner, name)
            if row is not None and (callable(value) or len(shape_of(name, value)) == len(row) + 1):
                courses.append(Course(owner, name, _unit(owner, name), value, row))
                continue
            refuse_functions(owner, name, value, in_time=True)
            still.setdefault(owner, {})[name] = value
    for owner in [each for each in scene.objects if any(course.owner is each for course in courses)]:
        if getattr(owner, "motion", None) is not None:
            raise ValueError(
                f"{owner!r} moves by its motion: give its center and rotation over time, or a motion, not both"
            )
        if changes_at_once(owner):
            continue
        constant = still.pop(owner, {})  # of its place: the same all the time
        courses += [Course(owner, name, _UNITS[name], value, (3,)) for name, value in constant.items()]
        if isinstance(owner, Obstacle):
            still[owner] = {"center": np.zeros(3), "rotation": np.zeros(3)}  # all of its place is on its path
    return still, courses


def refuse_functions(owner: Any, name: str, value: Any, in_time: bool) -> None:
    """Raises ValueError on a function where there must be numbers."""
    if not callable(value):
        return
    kind, can = type(owner).__name__, names_in_time(owner)
    if not in_time:
        raise ValueError(
            f"{name} of {kind} is a function; only ms.simulate takes functions, of the time: give numbers"
        )
    what = f"{nearest_first(name, can)} can" if can else "nothing of it can"
    raise ValueError(f"{name} of {kind} cannot change during a motion ({what}): give numbers")


def row_in_time(owner: Any, name: str) -> tuple[int, ...] | None:
    """The shape of a value that may change during a motion, at one time."""
    return np.shape(getattr(owner, name, np.zeros(3))) if name in names_in_time(owner) else None


def changes_at_once(owner: Any) -> bool:
    """Whether values of an object may jump during a motion; others move."""
    return isinstance(owner, _JUMPING)


def values_between(before: Any, after: Any, share: float) -> dict[str, np.ndarray]:
    """The values that may move of an object that is `before`, and then `after`, a share of the way: on straight lines."""
    at = [each._move.as_arguments() if isinstance(each, Support) else vars(each) for each in (before, after)]
    named = {}
    for name in names_in_time(after):
        ends = [np.zeros(3) if each[name] is None and name != "center" else each[name] for each in at]
        if all(end is not None for end in ends):
            named[name] = (1.0 - share) * ends[0] + share * ends[1]
    return named


def names_in_time(owner: Any) -> tuple[str, ...]:
    """The values of an object that may change during a motion."""
    return getattr(owner, "_in_time", ())
