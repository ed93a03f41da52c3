"""Values prescribed over the time of a motion, and the time points at which the core needs them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached, is_tensor
from ...model.contact.obstacles import Obstacle
from ...model.scene.time_varying import may_jump, refuse_functions, row_in_time, unit_in_time
from ..options import Clock

if TYPE_CHECKING:
    from ..._input.kinds import Numbers
    from ...model.scene.scene import Scene


@dataclass(frozen=True)
class TimePoints:
    """The times at which the core needs values: the start and the stages of each step, one step after another.

    steps: how many. stages: the times of the stages, as fractions of a step. time_step: as given; if it is a tensor,
    functions of the time get the time as a tensor in its graph.
    """

    steps: int
    stages: tuple[float, ...]
    clock: Clock
    time_step: Numbers

    @property
    def fractions(self) -> np.ndarray:
        """The time points of each step as fractions of it, (stages + 1,)."""
        return np.array((0.0, *self.stages))

    @property
    def times(self) -> np.ndarray:
        """The times of all time points, (n,) s."""
        return self.clock.at(np.arange(self.steps)[:, None], self.fractions).ravel()

    def recorded(self, count: int, every: int) -> np.ndarray:
        """Return the indices of the first `count` recorded states: the start, then the end of every so many steps."""
        ends = len(self.fractions) * every * np.arange(1, count) - 1
        return np.concatenate([[0], ends])

    def __len__(self) -> int:
        return self.steps * len(self.fractions)


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
        if callable(value):
            return self._called(points)
        shape = shape_of(f"{name} [{unit}]", value)
        allowed = (row, (points.steps, *row), (points.steps + 1, *row))
        if shape not in allowed:
            raise ValueError(
                f"{name} [{unit}] must have shape {row if row else '() (a number)'}, (steps, ...) = {allowed[1]} or "
                f"(steps + 1, ...) = {allowed[2]}, or be a function of the time, got {shape}"
            )
        quantity(name, unit, detached(value), shape)
        if not is_tensor(value):
            value = np.asarray(value, dtype=np.float64)
        fractions = points.fractions
        if shape == row:
            return _repeated(value, len(points))
        if len(value) == points.steps:
            count = len(fractions)
            return value.repeat_interleave(count, 0) if is_tensor(value) else value.repeat(count, axis=0)
        column = fractions.reshape(1, -1, *(1 for _ in row))
        if is_tensor(value):
            column = value.new_tensor(column)
        between = value[:-1, None] * (1.0 - column) + value[1:, None] * column
        return between.reshape(-1, *row)

    def _called(self, points: TimePoints):
        """Return the values of a function of the time, which is called once for each time, also where two steps meet."""
        known = {}

        def at(step: int, fraction: float):
            key = (step + 1, 0.0) if fraction == 1.0 else (step, fraction)
            if key not in known:
                moment = points.clock.moment(*key, points.time_step)
                known[key] = self.value(moment)
                quantity(
                    f"{self.name} at {float(detached(moment)):g} s", self.unit, detached(known[key]), self.row
                )
            return known[key]

        values = [at(step, fraction) for step in range(points.steps) for fraction in points.fractions]
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
