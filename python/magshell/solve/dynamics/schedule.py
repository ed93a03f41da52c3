"""Values prescribed over the time of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached, is_tensor
from ...model.contact.obstacles import Obstacle
from ...model.scene.time_varying import may_jump, refuse_functions, row_in_time, unit_in_time
from .time_steps import TimePoints

if TYPE_CHECKING:
    from ...model.scene.scene import Scene


@dataclass(frozen=True)
class AtTimePoints:
    """A value as it was in another motion of the same steps: its rows at all time points, (time points, *row)."""

    rows: np.ndarray


@dataclass(frozen=True)
class Schedule:
    """One value prescribed over the time of a motion, a parameter of an object or a keyword of ms.simulate.

    owner: the object; the scene for a keyword. row: the shape of the value at one time.
    value: constant, of shape row; one for each step, (steps, *row); at the ends of all steps, (steps + 1, *row),
    interpolated linearly; or a function of the motion's time [s]. A tensor stays in its graph.
    """

    owner: Any
    name: str
    unit: str
    row: tuple[int, ...]
    value: Any

    def check(self, steps: int) -> None:
        """Raise ValueError unless the value of an object has one of the forms that are possible for it.

        Only a parameter that may jump can have one value for each step.
        """
        if callable(self.value):
            return
        label = f"{self.name} [{self.unit}] of {type(self.owner).__name__}"
        shape = shape_of(label, self.value)
        if shape == self.row:
            return
        allowed = {"(steps + 1, ...)": (steps + 1, *self.row)}
        if may_jump(self.owner):
            allowed["(steps, ...)"] = (steps, *self.row)
        if shape not in allowed.values():
            wanted = " or ".join(f"{name} = {each}" for name, each in allowed.items())
            why = ", as one a step would have it jump" if shape == (steps, *self.row) else ""
            raise ValueError(
                f"{label} must have shape {self.row}, or {wanted} to move in time{why}, or be a function of the time; "
                f"got {shape}"
            )

    def at(self, points: TimePoints) -> Any:
        """Return the value at all time points, (time points, *row). Raises ValueError if it has none of the forms above."""
        name, unit, row, value = self.name, self.unit, self.row, self.value
        if isinstance(value, AtTimePoints):
            return value.rows
        if callable(value):
            return self._called(points)
        shape = shape_of(f"{name} [{unit}]", value)
        intervals = points.steps.n_intervals
        allowed = (row, (intervals, *row), (intervals + 1, *row))
        if shape not in allowed:
            raise ValueError(
                f"{name} [{unit}] must have shape {row if row else '() (a number)'}, (steps, ...) = {allowed[1]} or "
                f"(steps + 1, ...) = {allowed[2]}, or be a function of the time, got {shape}"
            )
        quantity(name, unit, detached(value), shape)
        if not is_tensor(value):
            value = np.asarray(value, dtype=np.float64)
        if shape == row:
            return _repeated(value, len(points))
        within = points.intervals
        if len(value) == intervals:
            return value[within]
        column = points.fractions_of_intervals.reshape(-1, *(1 for _ in row))
        changes = points.changes_of_fractions
        if is_tensor(value):
            column = value.new_tensor(column)
        if changes is not None:
            if not is_tensor(value):
                value, column = changes.new_tensor(value), changes.new_tensor(column)
            column = column + changes.reshape(column.shape)
        return value[within] * (1.0 - column) + value[within + 1] * column

    def _called(self, points: TimePoints):
        """Return the values of a function of the time, which is called once for each time, also where two steps meet."""
        known = {}

        def at(step: int, fraction: float):
            key = (step + 1, 0.0) if fraction == 1.0 else (step, fraction)
            if key not in known:
                moment = points.steps.moment(step, fraction)
                known[key] = self.value(moment)
                quantity(
                    f"{self.name} at {float(detached(moment)):g} s", self.unit, detached(known[key]), self.row
                )
            return known[key]

        values = [at(step, fraction) for step in range(len(points.steps)) for fraction in points.fractions]
        if any(is_tensor(each) for each in values):
            import torch

            return torch.stack([torch.as_tensor(each, dtype=torch.float64) for each in values])
        return np.array(values, dtype=np.float64)


def split_schedules(
    scene: Scene, replaced: dict[object, dict[Any, Any]]
) -> tuple[dict[object, dict[Any, Any]], list[Schedule]]:
    """Split the values of a solve into constant ones, {object: {name: value}}, and those prescribed over time.

    Raises ValueError for a parameter that cannot change during a motion.
    """
    constant: dict[object, dict[Any, Any]] = {}
    schedules: list[Schedule] = []
    for owner, named in replaced.items():
        for name, value in named.items():
            row = row_in_time(owner, name)
            if row is not None and (callable(value) or len(shape_of(name, value)) == len(row) + 1):
                schedules.append(Schedule(owner, name, unit_in_time(owner, name), row, value))
                continue
            refuse_functions(owner, name, value, in_time=True)
            constant.setdefault(owner, {})[name] = value
    for owner in [each for each in scene.objects if any(schedule.owner is each for schedule in schedules)]:
        if getattr(owner, "motion", None) is not None:
            raise ValueError(
                f"{owner!r} moves by its motion: give its center and rotation over time, or a motion, not both"
            )
        if may_jump(owner):
            continue
        own = constant.pop(owner, {})  # the constant part of its pose; it joins the path
        schedules += [
            Schedule(owner, name, unit_in_time(owner, name), (3,), value) for name, value in own.items()
        ]
        if isinstance(owner, Obstacle):
            constant[owner] = {
                "center": np.zeros(3),
                "rotation": np.zeros(3),
            }  # the path holds the whole pose
    return constant, schedules


def _repeated(value, count: int):
    """Return one value repeated for all time points."""
    shape = (count, *value.shape)
    return value.expand(*shape) if is_tensor(value) else np.broadcast_to(value, shape)
