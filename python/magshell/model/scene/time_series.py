"""Parameters prescribed over the time of a motion: an array with one row per step end, or a function of the time."""

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

# Parameters of these classes may jump between steps. Those of supports and obstacles may not: a jump would be an infinite
# velocity.
_MAY_JUMP = (AppliedField, Joint, Actuator, Shell)


@dataclass(frozen=True)
class TimeSeries:
    """One parameter of one object, prescribed over the time of a motion. row: the shape of its value at one time."""

    owner: Any
    name: str
    unit: str
    value: Any
    row: tuple[int, ...]

    def check(self, steps: int) -> None:
        """Raise ValueError unless the value is a function of the time, or an array of the right shape.

        An array has a row for each end of a step (steps + 1); a parameter that may jump may also have one for each
        step.
        """
        if callable(self.value):
            return
        shape = shape_of(self._label, self.value)
        if shape == self.row:
            return
        allowed = {"(steps + 1, ...)": (steps + 1, *self.row)}
        if may_jump(self.owner):
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


def split_time_series(
    scene: Scene, replaced: dict[object, dict[Any, Any]]
) -> tuple[dict[object, dict[Any, Any]], list[TimeSeries]]:
    """Split the values of a solve into constant ones, {object: {name: value}}, and time series.

    Raises ValueError for a time series of a parameter that cannot change during a motion.
    """
    still: dict[object, dict[Any, Any]] = {}
    courses: list[TimeSeries] = []
    for owner, named in replaced.items():
        for name, value in named.items():
            row = row_in_time(owner, name)
            if row is not None and (callable(value) or len(shape_of(name, value)) == len(row) + 1):
                courses.append(TimeSeries(owner, name, _unit(owner, name), value, row))
                continue
            refuse_functions(owner, name, value, in_time=True)
            still.setdefault(owner, {})[name] = value
    for owner in [each for each in scene.objects if any(course.owner is each for course in courses)]:
        if getattr(owner, "motion", None) is not None:
            raise ValueError(
                f"{owner!r} moves by its motion: give its center and rotation over time, or a motion, not both"
            )
        if may_jump(owner):
            continue
        constant = still.pop(owner, {})  # the constant part of its pose; it joins the path
        courses += [TimeSeries(owner, name, _UNITS[name], value, (3,)) for name, value in constant.items()]
        if isinstance(owner, Obstacle):
            still[owner] = {"center": np.zeros(3), "rotation": np.zeros(3)}  # the path holds the whole pose
    return still, courses


def refuse_functions(owner: Any, name: str, value: Any, in_time: bool) -> None:
    """Raise ValueError if a value is a function where only numbers are allowed.

    in_time: the solve is a motion, so other values of this object may be functions of the time.
    """
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
    """Return the shape that a parameter has at one time; None if it may not change during a motion."""
    return np.shape(getattr(owner, name, np.zeros(3))) if name in names_in_time(owner) else None


def may_jump(owner: Any) -> bool:
    """Return whether the parameters of an object may change discontinuously during a motion."""
    return isinstance(owner, _MAY_JUMP)


def values_between(before: Any, after: Any, fraction: float) -> dict[str, np.ndarray]:
    """Interpolate linearly the time-varying values of an object between its states `before` and `after`."""
    at = [each._move.as_arguments() if isinstance(each, Support) else vars(each) for each in (before, after)]
    named = {}
    for name in names_in_time(after):
        ends = [np.zeros(3) if each[name] is None and name != "center" else each[name] for each in at]
        if all(end is not None for end in ends):
            named[name] = (1.0 - fraction) * ends[0] + fraction * ends[1]
    return named


def names_in_time(owner: Any) -> tuple[str, ...]:
    """Return the names of the values of an object that may change during a motion."""
    return getattr(owner, "_in_time", ())
