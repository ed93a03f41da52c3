"""The table of joints: what sets each kind apart from the others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

_FAR = 1e300  # a limit that no joint reaches


@dataclass(frozen=True)
class JointSpec:
    """The properties that set one kind of joint apart from the others.

    kind: its name in the core. freedoms: how many coordinates it has. slides: whether its coordinate is a length [m], not
    an angle [rad]. defaults: by the name of each number, the value with which it does not act. vectors: the unit of each
    number that has three components. axis: whether it has an axis: "none", "required", or "optional". numbers: the unit of
    each number that is needed besides origin and axis, in the order of the core's JointKind::Traits.
    """

    kind: str
    freedoms: int = 0
    slides: bool = False
    axis: str = "none"
    defaults: dict[str, Any] = field(default_factory=dict)
    vectors: dict[str, str] = field(default_factory=dict)
    numbers: dict[str, str] = field(default_factory=dict)

    @property
    def motor(self) -> str:
        """The name of the number that prescribes its coordinate; empty without one."""
        return next((name for name in self.defaults if name.startswith("motor_")), "")

    @property
    def replaceable(self) -> tuple[str, ...]:
        """The names of all numbers that a solve can replace."""
        rate = ("rate",) if self.freedoms else ()
        axis = () if self.axis == "none" else ("axis",)
        return (*self.defaults, *rate, "origin", *axis, *self.numbers)

    def unit(self, name: str) -> str:
        """Return the unit of one of its numbers; that of its coordinate if the name is empty."""
        if name in self.vectors or name in self.numbers:
            return {**self.vectors, **self.numbers}[name]
        for names, of_angle, of_length in _UNITS:
            if name in names:
                return of_length if self.slides else of_angle
        return "m" if self.slides else "rad"


_UNITS = (
    (("damping",), "N m s/rad", "N s/m"),
    (("spring_stiffness", "servo_stiffness", "limit_stiffness"), "N m/rad", "N/m"),
    (("torque", "torque_limit", "force", "force_limit"), "N m", "N"),
)


def _one_coordinate(coordinate: str, force: str) -> dict[str, Any]:
    """Return the numbers of a joint with one coordinate, and the values with which they do not act."""
    return {
        "spring_stiffness": 0.0,
        f"rest_{coordinate}": 0.0,
        "damping": 0.0,
        force: 0.0,
        f"motor_{coordinate}": 0.0,
        f"target_{coordinate}": 0.0,
        "servo_stiffness": 0.0,
        f"{force}_limit": _FAR,
        "lower_limit": -_FAR,
        "upper_limit": _FAR,
        "limit_stiffness": 0.0,
        "limit_smoothing": 1.0,
    }


_BALL: dict[str, Any] = {
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

_SPECS = (
    JointSpec("fixed"),
    JointSpec("revolute", freedoms=1, axis="required", defaults=_one_coordinate("angle", "torque")),
    JointSpec(
        "screw",
        freedoms=1,
        axis="required",
        defaults=_one_coordinate("angle", "torque"),
        numbers={"pitch": "m/rad"},
    ),
    JointSpec(
        "prismatic",
        freedoms=1,
        slides=True,
        axis="required",
        defaults=_one_coordinate("displacement", "force"),
    ),
    JointSpec(
        "ball",
        freedoms=3,
        axis="optional",
        defaults=_BALL,
        vectors={"torque": "N m", "motor_rotation": "rad", "target_rotation": "rad"},
    ),
    JointSpec("closure", defaults={"stiffness": 0.0}),
)
JOINTS = {spec.kind: spec for spec in _SPECS}
