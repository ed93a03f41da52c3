"""Values prescribed over time as the core takes them: at all time points of a motion, beside its load parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.tensors import detached
from ...model.actuators.actuator import Actuator
from ...model.contact.obstacles import Obstacle
from ...model.fields.field import AppliedField
from ...model.loads.springs import Springs
from ...model.shells.shell import Shell
from ...model.supports.supports import Support
from .obstacle_paths import ObstaclePath, check_supports
from .schedule import Schedule

if TYPE_CHECKING:
    from .motion_inputs import MotionInputs
    from .time_steps import TimePoints

_WITH_RESULTS = (Actuator, AppliedField, Shell, Springs)


class ScheduledValues:
    """The values of a scene that change during one motion, at all its time points.

    entries: indices of these values in the core's vector of values; rows: (time points, m), the numbers, which follow the
    load parameters. poses: {number of an obstacle: its poses (time points, 4, 3)}. varied: {(object, name): (time points,
    ...)}, of the objects whose results or pictures depend on the values of their time.
    """

    def __init__(self, asked: MotionInputs, schedules: list[Schedule]):
        self._asked = asked
        self._of_values: list[tuple[Schedule, int]] = []  # with the number of slices of each
        self._paths: dict[int, ObstaclePath] = {}
        self._layout = list(asked.inputs.scene._value_layout)
        self._slices: dict[tuple[int, str], list[slice]] = {}
        self.entries: list[int] = []
        self.poses: dict[int, np.ndarray] = {}
        self.varied: dict[tuple[Any, str], np.ndarray] = {}
        for each in schedules:
            each.check(asked.steps)
        of_values = [each for each in schedules if not isinstance(each.owner, Obstacle)]
        numbers_of = [asked.at_time_points(each) for each in of_values]
        check_supports(
            asked,
            [(c, k) for c, k in zip(of_values, numbers_of, strict=True) if isinstance(c.owner, Support)],
        )
        rows = [np.zeros((len(asked.time_points), 0))]
        for each, given in zip(of_values, numbers_of, strict=True):
            numbers = np.reshape(
                asked.inputs.take(each.name, given, _Values(self, each)), (len(asked.time_points), -1)
            )
            now = numbers.reshape(-1, *each.row)
            each.owner._check_in_time(each.name, now)
            if isinstance(each.owner, _WITH_RESULTS):
                self.varied[each.owner, each.name] = now
            self._of_values.append((each, self._add(each, numbers.shape[1])))
            rows += [numbers] * self._of_values[-1][1]
        self.rows: np.ndarray = np.concatenate(rows, axis=1)
        self._add_obstacles([each for each in schedules if isinstance(each.owner, Obstacle)])

    def at(self, points: TimePoints) -> tuple[np.ndarray, dict[int, np.ndarray]]:
        """Return `rows` and `poses` at other time points."""
        value_of = lambda schedule: schedule.at(points)  # noqa: E731
        rows = [np.zeros((len(points), 0))]
        for schedule, count in self._of_values:
            numbers = np.asarray(detached(value_of(schedule)), dtype=np.float64)
            schedule.owner._check_in_time(schedule.name, numbers.reshape(-1, *schedule.row))
            rows += [numbers.reshape(len(points), -1)] * count
        poses = {k: np.asarray(detached(path.poses_at(points, value_of))) for k, path in self._paths.items()}
        return np.concatenate(rows, axis=1), poses

    def _add(self, schedule: Schedule, width: int) -> int:
        """Find the slices of a value in the core's vectors and return how many there are."""
        owner, values = schedule.owner, self._asked.inputs.values
        labels = [label for each, label in self._asked.inputs.scene._labels if each is owner]
        if isinstance(owner, Support):
            labels = [label for label, _ in owner._moves(values)]
            if not labels:
                raise ValueError(
                    "a support that stays cannot be moved by a solve: give it a displacement in the scene, zero will do"
                )
        end = self._asked.inputs.scene._load_parameter_layout.size
        end += sum(part.stop - part.start for slices in self._slices.values() for part in slices)
        slices = self._slices[id(owner), schedule.name] = []
        for label in labels:
            self.entries.append(self._layout.index((label, schedule.name)))
            slices.append(slice(end, end + width))
            end += width
        return len(labels)

    def _add_obstacles(self, schedules: list[Schedule]) -> None:
        values, obstacles = self._asked.inputs.values, self._asked.inputs.scene.obstacles
        for k, obstacle in enumerate(obstacles):
            if its_own := {each.name: each.value for each in schedules if each.owner is obstacle}:
                path = ObstaclePath(self._asked, obstacle, its_own)
                self._paths[k] = path
                self.poses[k] = self._asked.inputs.take(
                    "center", path.poses, _Pose(self._asked.inputs.scene._load_parameter_layout, k)
                )
                values.move(obstacle, path)


class _Values:
    """The owner of one schedule as a leaf: gives its gradient at all time points. object_in_time: whose value it is."""

    def __init__(self, scheduled: ScheduledValues, schedule: Schedule):
        self.object_in_time: Any = schedule.owner
        self._slices, self._key = scheduled._slices, (id(schedule.owner), schedule.name)

    def by_time_points(self, gradient: Any) -> np.ndarray:
        return sum(gradient.of_load_parameters(part) for part in self._slices[self._key])

    def columns(self) -> list[np.ndarray]:
        """Return the columns of the core's load parameters that have these numbers, once for each slice."""
        return [np.arange(part.start, part.stop) for part in self._slices[self._key]]


class _Pose:
    """The owner of an obstacle's poses as a leaf: gives their gradient at all time points."""

    def __init__(self, layout: Any, number: int):
        self._layout, self._number = layout, number

    def by_time_points(self, gradient: Any) -> np.ndarray:
        return gradient.load_parameter(f"obstacle {self._number}", "pose")

    def columns(self) -> list[np.ndarray]:
        """Return the columns of the core's load parameters that have these poses."""
        entries = np.arange(self._layout.size)
        return [self._layout.of(entries, f"obstacle {self._number}", "pose").ravel()]
