"""Evaluates the function that moves an obstacle, and differentiates it by the time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ...._input.quantity import quantity

STEP = 1e-4  # [s] step of the differences
# Weights of fourth-order differences: central, and forward near time 0, before which the motion need not be defined.
CENTRAL = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
FORWARD = {0: -25 / 12, 1: 4.0, 2: -3.0, 3: 4 / 3, 4: -1 / 4}

_RETURNS = "a displacement (3,) [m], or a pair of it and a rotation vector (3,) [rad]"


def matrix(rotation_vector: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,) rad."""
    return scipy.spatial.transform.Rotation.from_rotvec(np.array(rotation_vector)).as_matrix()


def pose(motion: Callable[..., Any] | None, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement (3,) m and the rotation vector (3,) rad at a time [s].

    Raises ValueError if the function returns anything else.
    """
    time = float(quantity("time", "s", time, ()))
    if motion is None:
        return np.zeros(3), np.zeros(3)
    found = motion(time)
    call = f"motion({time:g})"
    try:
        length = len(found)
    except TypeError:
        raise ValueError(f"{call} must return {_RETURNS}; got {found!r:.60}") from None
    if length == 2:
        displacement, rotation = found
        return (
            quantity(f"the displacement of {call}", "m", displacement, (3,)),
            quantity(f"the rotation vector of {call}", "rad", rotation, (3,)),
        )
    if length != 3:
        raise ValueError(f"{call} must return {_RETURNS}; got {length} entries")
    return quantity(call, "m", found, (3,)), np.zeros(3)


def rates(motion: Callable[..., Any] | None, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity (3,) m/s and the angular velocity omega (3,) rad/s in world axes at a time [s].

    The rotation matrix changes by dR/dt = [omega] R.
    """
    time = float(quantity("time", "s", time, ()))
    if motion is None:
        return np.zeros(3), np.zeros(3)
    weights = FORWARD if 0 <= time < 2 * STEP else CENTRAL
    velocity, turning = np.zeros(3), np.zeros((3, 3))
    for steps, weight in weights.items():
        displacement, rotation = pose(motion, time + steps * STEP)
        velocity += weight / STEP * displacement
        turning += weight / STEP * matrix(rotation)
    skew = turning @ matrix(pose(motion, time)[1]).T
    return velocity, 0.5 * np.array(
        [skew[2, 1] - skew[1, 2], skew[0, 2] - skew[2, 0], skew[1, 0] - skew[0, 1]]
    )
