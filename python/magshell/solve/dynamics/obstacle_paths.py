"""Moves obstacles and supports along their paths in time."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import shape_of
from ..._input.tensors import detached, is_tensor, require_torch
from ...model.contact.obstacles._motion import CENTRAL, FORWARD, STEP
from ...model.supports import constraints
from .schedule import Schedule

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..._input.kinds import Numbers
    from .motion_inputs import MotionInputs
    from .time_steps import TimePoints


class ObstaclePath:
    """The path of one obstacle during a motion. Called with a time [s], it returns the center and the rotation vector there.

    poses: center (m), rotation vector (rad), velocity (m/s) and spin (rad/s, world axes) at all time points of a motion,
    (time points, 4, 3); a tensor if the center, the rotation or the time step is one.

    Centers and rotation vectors that are given at the ends of steps are interpolated linearly. Their rates are interpolated
    linearly between the slopes at the ends of steps, each that of the parabola through three neighbouring ends: both are of
    second order. Functions are differentiated over 1e-4 s to fourth order, as an obstacle's motion is.
    """

    def __init__(self, asked: MotionInputs, obstacle: Any, given: dict[str, object]):
        self._steps = asked.time_steps
        self._given = {
            "center": given.get("center", obstacle.center),
            "rotation": given.get("rotation", obstacle.rotation),
        }
        self._schedules = [
            Schedule(obstacle, name, unit, (3,), value)
            for (name, value), unit in zip(self._given.items(), ("m", "rad"), strict=True)
        ]
        self.poses: Any = self.poses_at(asked.time_points, asked.at_time_points)

    def poses_at(self, points: TimePoints, value_of: Callable[[Schedule], Any]) -> Any:
        """Return the poses and their rates at time points, (time points, 4, 3).

        value_of: returns the value of a schedule there.
        """
        rows = [(value_of(each), self._rates(points, each, value_of)) for each in self._schedules]
        xp, ((center, velocity), (rotation, rate)) = alike(rows)
        return xp.stack((center, rotation, velocity, spin(xp, rotation, rate)), 1)

    def __call__(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        return self._at("center", time), self._at("rotation", time)

    def _at(self, name: str, time: float) -> np.ndarray:
        value = self._given[name]
        if callable(value):
            return np.asarray(detached(value(self._as_given(time))), dtype=np.float64)
        numbers = np.asarray(detached(value), dtype=np.float64)
        if numbers.ndim == 1:
            return numbers
        return np.array([np.interp(time, self._steps.grid_times, column) for column in numbers.T])

    def _as_given(self, time: float):
        """Return a time as it is passed to functions of the time: a tensor where the time step is one."""
        length = self._steps.interval_length
        return length.new_tensor(time).double() if is_tensor(length) else time

    @staticmethod
    def _rates(points: TimePoints, schedule: Schedule, value_of: Callable[[Schedule], Any]):
        """Return the rate of a value at time points, (time points, 3)."""
        name, unit, value = schedule.name, schedule.unit, schedule.value
        if callable(value):
            rate = Schedule(
                schedule.owner, f"the rate of {name}", f"{unit}/s", (3,), lambda t: _slope(value, t)
            )
            return value_of(rate)
        if len(shape_of(name, value)) == 1:
            return np.zeros((len(points), 3))
        slopes = _slopes(value, points.steps.lengths_of_intervals)
        return Schedule(schedule.owner, name, unit, (3,), slopes).at(points)


@dataclass(frozen=True)
class ReadPath:
    """An obstacle's path as numbers, for a copy or a file, with linear interpolation in between.

    times: (n,) s, those of the recorded states and the ones around them from which rates are computed. centers: (n, 3) m.
    rotations: (n, 3) rad.
    """

    times: np.ndarray
    centers: np.ndarray
    rotations: np.ndarray

    @classmethod
    def of(cls, path: ObstaclePath, recorded: np.ndarray) -> ReadPath:
        early = (recorded >= 0) & (recorded < 2 * STEP)  # one-sided differences, as in `_slope`
        ahead = recorded[early][:, None] + np.array(list(FORWARD)) * STEP
        around = recorded[~early][:, None] + np.array([0, *CENTRAL]) * STEP
        times = np.unique(np.concatenate([ahead.ravel(), around.ravel()]))
        centers, rotations = zip(*(path(time) for time in times.tolist()), strict=True)
        return cls(times, np.array(centers), np.array(rotations))

    def __call__(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        center, rotation = (
            np.array([np.interp(time, self.times, column) for column in rows.T])
            for rows in (self.centers, self.rotations)
        )
        return center, rotation


def _slopes(ends, time_step):
    """Return the slopes (steps + 1, 3) at the ends of steps of parabolas through three neighbouring ends.

    time_step: s, a number, or one for each step (steps,).
    """
    xp, (ends, time_step) = alike((ends, time_step))
    if time_step.ndim > 0:
        return _slopes_of_unequal(xp, ends, time_step[:, None])
    if len(ends) == 2:
        slope = (ends[1:] - ends[:-1]) / time_step
        return xp.concatenate((slope, slope), 0)
    first = -1.5 * ends[:1] + 2.0 * ends[1:2] - 0.5 * ends[2:3]
    last = 1.5 * ends[-1:] - 2.0 * ends[-2:-1] + 0.5 * ends[-3:-2]
    return xp.concatenate((first, 0.5 * (ends[2:] - ends[:-2]), last), 0) / time_step


def _slopes_of_unequal(xp: ModuleType, ends, lengths):
    """Return the slopes as `_slopes` does at the ends of unequal steps; lengths: (steps, 1) s."""
    slopes = (ends[1:] - ends[:-1]) / lengths
    if len(slopes) == 1:
        return xp.concatenate((slopes, slopes), 0)
    before, after = lengths[:-1], lengths[1:]
    bend = (slopes[1:] - slopes[:-1]) / (before + after)
    first = slopes[:1] - bend[:1] * before[:1]
    last = slopes[-1:] + bend[-1:] * after[-1:]
    return xp.concatenate((first, slopes[:-1] + bend * before, last), 0)


def _slope(function, time):
    """Return the derivative of a function of the time, numbers or a tensor, by differences that use no negative time."""
    weights = FORWARD if 0 <= float(detached(time)) < 2 * STEP else CENTRAL
    found = [function(time + steps * STEP) for steps in weights]
    _, found = alike([list(each) if isinstance(each, tuple) else each for each in found])
    return sum(weight / STEP * each for weight, each in zip(weights.values(), found, strict=True))


def spin(xp: ModuleType, vector: Any, rate: Numbers) -> Any:
    """Return the angular velocity J(w) dw/dt of R(w), (n, 3) rad/s in world axes, J the left Jacobian of rotations."""
    square = (vector * vector).sum(-1)[:, None]
    small = square < 1e-4  # where the closed forms cancel, and have no derivative at zero
    safe = xp.where(small, xp.ones_like(square), square)
    angle = xp.sqrt(safe)
    first = xp.where(small, 0.5 - square / 24.0 + square**2 / 720.0, 2.0 * xp.sin(0.5 * angle) ** 2 / safe)
    second = xp.where(
        small, 1.0 / 6.0 - square / 120.0 + square**2 / 5040.0, (angle - xp.sin(angle)) / (safe * angle)
    )
    across = _cross(xp, vector, rate)
    return rate + first * across + second * _cross(xp, vector, across)


def _cross(xp: ModuleType, a, b):
    return xp.stack(
        (
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ),
        1,
    )


def alike(values: Any) -> tuple[ModuleType, Any]:
    """Return torch and the values as tensors if one of them is a tensor, else numpy and the values as arrays; float64."""
    if any(is_tensor(each) for each in _flat(values)):
        torch = require_torch("a path")
        tensor = lambda each: each if is_tensor(each) else torch.tensor(np.array(each, dtype=np.float64))  # noqa: E731
        return torch, _mapped(values, lambda each: tensor(each).double())
    return np, _mapped(values, lambda each: np.asarray(each, dtype=np.float64))


def _flat(values):
    return [each for value in values for each in (_flat(value) if isinstance(value, tuple) else [value])]


def _mapped(values, change):
    return [_mapped(each, change) if isinstance(each, tuple) else change(each) for each in values]


def check_supports(asked: MotionInputs, prescribed: list[Any]) -> None:
    """Raises ValueError where a support is moved, at the end of a step, against another that holds the same vertex.

    prescribed: (schedule of a value of a support, its value at all time points).
    """
    scene, values = asked.inputs.scene, asked.inputs.values
    moving = {id(each.owner) for each, _ in prescribed}
    if stuck := [each for each in scene._constraints.bound if id(each) in moving]:
        raise ValueError(
            f"{stuck[0]!r} cannot move in time: supports or other ties hold some of its vertices"
        )
    if not moving or len(scene.supports) < 2:
        return
    held = {
        id(each): np.unique(
            np.concatenate(
                [
                    np.zeros(0, dtype=np.int64),
                    *(h.vertices for h in constraints.held_by(each, scene._bodies.of(each), scene._bodies)),
                ]
            )
        )
        for each in scene.supports
    }
    every = np.concatenate(list(held.values()))
    shared = np.flatnonzero(np.bincount(every) > 1)
    if not any(np.isin(vertices, shared).any() for key, vertices in held.items() if key in moving):
        return
    a_step = len(asked.integrator._times) + 1
    for k in (0, *range(a_step - 1, len(asked.time_points), a_step)):
        now: dict[Any, Any] = {}
        for schedule, numbers in prescribed:
            now.setdefault(schedule.owner, {})[schedule.name] = np.asarray(detached(numbers))[k]
        supports = [values.current(each) for each in scene.supports]
        supports = [
            there.replaced(**now[each]) if each in now else there
            for each, there in zip(scene.supports, supports, strict=True)
        ]
        constraints.check_shared(scene._bodies, supports, shared)
