"""Courses as the core takes them: values at all knots of a motion, among its controls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...model.actuators.actuator import Actuator
from ...model.contact.obstacles import Obstacle
from ...model.fields.field import AppliedField
from ...model.scene.time_series import TimeSeries
from ...model.shells.shell import Shell
from ...model.supports.supports import Support
from .obstacle_paths import ObstaclePath, check_supports

if TYPE_CHECKING:
    from .motion_inputs import MotionInputs


class InTime:
    """What of a scene's values changes during one motion.

    entries: of the core's values, those that follow the other controls; rows: (knots, m), theirs. poses: {number of an
    obstacle: its poses at the knots (knots, 4, 3)}. varied: {(actuator, shell or field, name): (knots, ...)}.
    """

    def __init__(self, asked: MotionInputs, courses: list[TimeSeries]):
        self._asked = asked
        self._layout = list(asked.inputs.scene._value_layout)
        self._places: dict[tuple[int, str], list[slice]] = {}
        self.entries: list[int] = []
        self.poses: dict[int, np.ndarray] = {}
        self.varied: dict[tuple[Actuator | Shell | AppliedField, str], np.ndarray] = {}
        for course in courses:
            course.check(asked.steps)
        of_values = [each for each in courses if not isinstance(each.owner, Obstacle)]
        knots = [asked.at_knots(each.name, each.unit, each.value, each.row) for each in of_values]
        check_supports(
            asked, [(c, k) for c, k in zip(of_values, knots, strict=True) if isinstance(c.owner, Support)]
        )
        rows = [np.zeros((asked.knots, 0))]
        for course, at_knots in zip(of_values, knots, strict=True):
            numbers = np.reshape(
                asked.inputs.take(course.name, at_knots, _Values(self, course)), (asked.knots, -1)
            )
            if isinstance(course.owner, Actuator | Shell | AppliedField):
                now = self.varied[course.owner, course.name] = numbers.reshape(-1, *course.row)
                course.owner._check_in_time(course.name, now)
            rows += [numbers] * self._add(course, numbers.shape[1])
        self.rows: np.ndarray = np.concatenate(rows, axis=1)
        self._add_obstacles([each for each in courses if isinstance(each.owner, Obstacle)])

    def _add(self, course: TimeSeries, width: int) -> int:
        """Finds the places of a value in the core; how many there are."""
        owner, values = course.owner, self._asked.inputs.values
        labels = [label for each, label in self._asked.inputs.scene._labels if each is owner]
        if isinstance(owner, Support):
            labels = [label for label, _ in owner._moves(values)]
            if not labels:
                raise ValueError(
                    "a support that stays cannot be moved by a solve: give it a displacement in the scene, zero will do"
                )
        end = self._asked.inputs.scene._control_layout.size
        end += sum(place.stop - place.start for places in self._places.values() for place in places)
        places = self._places[id(owner), course.name] = []
        for label in labels:
            self.entries.append(self._layout.index((label, course.name)))
            places.append(slice(end, end + width))
            end += width
        return len(labels)

    def _add_obstacles(self, courses: list[TimeSeries]) -> None:
        values, obstacles = self._asked.inputs.values, self._asked.inputs.scene.obstacles
        for k, obstacle in enumerate(obstacles):
            if its_own := {each.name: each.value for each in courses if each.owner is obstacle}:
                path = ObstaclePath(self._asked, obstacle, its_own)
                self.poses[k] = self._asked.inputs.take("center", path.knots, _Pose(k))
                values.move(obstacle, path)


class _Values:
    """Owns the numbers of a course: by_knots is their gradient."""

    def __init__(self, in_time: InTime, course: TimeSeries):
        self._places, self._key = in_time._places, (id(course.owner), course.name)

    def by_knots(self, gradient: Any) -> np.ndarray:
        return sum(gradient.of_controls(place) for place in self._places[self._key])


class _Pose:
    """Likewise of an obstacle's poses."""

    def __init__(self, number: int):
        self._number = number

    def by_knots(self, gradient: Any) -> np.ndarray:
        return gradient.control(f"obstacle {self._number}", "pose")
