"""Says which values of objects may vary over the time of a motion, and interpolates them along a path."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._runtime.keywords import nearest_first
from ..actuators.actuator import Actuator
from ..fields.field import AppliedField
from ..loads.custom_energy import CustomEnergy
from ..loads.springs import Springs
from ..rigid.joints import Joint
from ..rigid.rigid import RigidBody
from ..shells.crease import Crease
from ..shells.shell import UNITS as _GROWTH_UNITS
from ..shells.shell import Shell
from ..supports.supports import Support

# Parameters of these classes may jump between steps. Those of supports and obstacles may not: a jump would be an infinite
# velocity.
_MAY_JUMP = (AppliedField, Joint, RigidBody, Actuator, Shell)

_UNITS = {
    "positions": "m",
    "moments": "A m^2",
    "remanent_magnetization": "A/m",
    "center": "m",
    "rotation": "rad",
    "displacement": "m",
    "pressure": "Pa",
    "force": "N",
    "torque": "N m",
    **_GROWTH_UNITS,
}


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


def unit_in_time(owner: Any, name: str) -> str:
    """Return the unit of a parameter that may change during a motion."""
    return (
        owner._unit(name)
        if isinstance(owner, Joint | Actuator | CustomEnergy | Springs | Crease)
        else _UNITS[name]
    )


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
