"""The steps of a motion in the intervals of its time grid, and the time points at which the core needs values."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import quantity, shape_of
from ..._input.tensors import detached, is_tensor, requires_gradient
from ..options import SHORTEST_STEP, Adaptive, Clock

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs

_ROUND_OFF = 1e-9  # [-] of an interval by which listed steps may miss its end; see test_steps_that_miss_the_grid_are_refused


@dataclass(frozen=True)
class TimeSteps:
    """The steps of a motion. Those in one interval of its grid lie one after another and fill it.

    clock: of the time at the beginning; it counts intervals if they are equal. interval: (m,), the number of the interval
    that each step is in. begin, end: (m,), fractions of it. lengths: (m,) s. grid: None, or the lengths of unequal
    intervals (n,) s, each of one step. n_intervals: their number. interval_length: as it was given, s, of equal intervals a
    number; a tensor stays in its graph. listed: the lengths (m,) as a tensor in its graph if they were given one by one and
    need a gradient; else None.
    """

    clock: Clock
    n_intervals: int
    interval: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    lengths: np.ndarray
    interval_length: Any
    grid: np.ndarray | None = None
    listed: Any = None

    @classmethod
    def equal(cls, inputs: Inputs, start: Clock, steps: int, time_step: Any) -> TimeSteps:
        """Return equal steps, one for each interval."""
        length = float(inputs.keyword("time_step", time_step))
        _check_shortest(length)
        one = np.ones(steps)
        return cls(start.going_on(length), steps, np.arange(steps), 0.0 * one, one, length * one, time_step)

    @classmethod
    def from_list(cls, start: Clock, steps: int, time_step: Any) -> TimeSteps:
        """Return steps of given lengths (m,): one for each interval, or more that fill equal intervals.

        Raises ValueError if they do not.
        """
        lengths = quantity("time_step", "s", detached(time_step), ("m",))
        if lengths.size and lengths.min() <= 0.0:
            raise ValueError(f"time_step [s] must be positive, but the smallest is {lengths.min():g}")
        if len(lengths) < steps:
            raise ValueError(
                f"time_step [s] must have one length for each of the {steps} steps, or more that divide them, got "
                f"{len(lengths)}"
            )
        _check_shortest(lengths.min())
        given = time_step if requires_gradient(time_step) else None
        if len(lengths) == steps:
            if (lengths == lengths[0]).all():
                clock, grid = start.going_on(float(lengths[0])), None
            else:
                clock, grid = Clock(start.time), lengths
            one = np.ones(steps)
            return cls(clock, steps, np.arange(steps), 0.0 * one, one, lengths, time_step, grid, given)
        ends = np.cumsum(lengths)
        length = ends[-1] / steps
        last = np.searchsorted(
            ends, length * (np.arange(1, steps + 1) - _ROUND_OFF)
        )  # step that ends each interval
        missed = np.abs(ends[last] - length * np.arange(1, steps + 1)) > _ROUND_OFF * length
        if missed.any():
            k = int(np.argmax(missed)) + 1
            raise ValueError(
                f"time_step [s] has {len(lengths)} lengths that add up to {ends[-1]:.6g} s, but not to steps = {steps} "
                f"equal intervals of {length:.6g} s: none ends at {k * length:.6g} s, the nearest at "
                f"{ends[last[k - 1]]:.6g} s. Give one length for each step, or the time_steps of a motion with as many steps"
            )
        first = np.concatenate([[0], last[:-1] + 1])
        interval = np.repeat(np.arange(steps), last - first + 1)
        end = np.concatenate(
            [
                np.cumsum(lengths[a : b + 1]) / lengths[a : b + 1].sum()
                for a, b in zip(first, last, strict=True)
            ]
        )
        end[last] = 1.0
        begin = np.concatenate([[0.0], end[:-1]])
        begin[first] = 0.0
        clock = start.going_on(float(length))
        if is_tensor(time_step):  # functions of the time get tensors
            length = time_step.new_tensor(length).double()
        return cls(clock, steps, interval, begin, end, lengths, length, None, given)

    @classmethod
    def undivided(cls, inputs: Inputs, start: Clock, steps: int, time_step: Adaptive) -> TimeSteps:
        """Return the intervals in which an Adaptive chooses steps, each as a single step."""
        return cls._in_intervals(inputs, start, steps, time_step, np.ones(steps))

    @classmethod
    def chosen(
        cls, inputs: Inputs, start: Clock, steps: int, time_step: Adaptive, lengths: list[float]
    ) -> TimeSteps:
        """Return steps that were chosen, and to the end of the grid, if they do not reach it, steps that fill it."""
        length = float(detached(time_step.interval))
        fractions = list(np.array(lengths) / length)  # powers of 1/2, exactly
        if rest := -sum(fractions) % 1.0:
            fractions.append(rest)
        fractions += [1.0] * round(steps - sum(fractions))
        return cls._in_intervals(inputs, start, steps, time_step, np.array(fractions))

    @classmethod
    def _in_intervals(
        cls, inputs: Inputs, start: Clock, steps: int, time_step: Adaptive, fractions: np.ndarray
    ) -> TimeSteps:
        given = time_step.interval
        if is_tensor(given):
            inputs.take("time_step", given * given.new_tensor(fractions))
        clock = start.going_on(float(detached(given)))
        ends = np.cumsum(fractions)  # without round-off
        interval = np.ceil(ends).astype(int) - 1
        end = ends - interval
        return cls(clock, steps, interval, end - fractions, end, fractions * clock.time_step, given)

    def part(self, interval: int, begin: float, end: float) -> TimeSteps:
        """Return a single step from one fraction of an interval to another."""
        rows = {"interval": np.array([interval]), "begin": np.array([begin]), "end": np.array([end])}
        return replace(self, **rows, lengths=np.array([(end - begin) * self.clock.time_step]))

    def __len__(self) -> int:
        return len(self.lengths)

    @cached_property
    def grid_times(self) -> np.ndarray:
        """The times between the intervals, (n_intervals + 1,) s."""
        if self.grid is not None:
            return self.clock.time + np.concatenate([[0.0], np.cumsum(self.grid)])
        return self.clock.at(np.arange(self.n_intervals + 1))

    @cached_property
    def grid_ends(self) -> np.ndarray:
        """The numbers of steps after which the intervals end, 0 first, (n_intervals + 1,)."""
        return np.searchsorted(self.interval, np.arange(self.n_intervals + 1))

    def at(self, interval: Any, fraction: Any) -> Any:
        """Return the times at fractions of intervals, s: numbers or arrays."""
        if self.grid is None:
            return self.clock.at(interval, fraction)
        return self.grid_times[interval] + fraction * self.grid[interval]

    def clock_after(self, steps: int) -> Clock:
        """Return the clock after so many steps."""
        if self.grid is not None:
            return Clock(float(self.grid_times[steps]))
        if steps == 0:
            return self.clock
        last = steps - 1
        if self.end[last] == 1.0:
            return self.clock.after(int(self.interval[last]) + 1)
        return Clock(float(self.at(self.interval[last], self.end[last])))

    def fraction_of_interval(self, step: int, fraction: float) -> float:
        """Return the fraction of its interval at a fraction of a step."""
        if fraction == 1.0:
            return float(self.end[step])
        return float(self.begin[step] + fraction * (self.end[step] - self.begin[step]))

    @property
    def lengths_of_intervals(self) -> Any:
        """The lengths of intervals, s: one for all if they are equal, else (n_intervals,). A tensor stays in its graph.

        Intervals of several listed steps have the length of the sum, which is differentiable as well.
        """
        if self.listed is None or len(self) == self.n_intervals:
            return self.interval_length
        ends = self.grid_ends
        return self.interval_length + (self._changes[ends[1:]] - self._changes[ends[:-1]])

    @property
    def tensor(self) -> Any:
        """The tensor by which the times have a gradient, or None."""
        given = self.interval_length if self.listed is None else self.listed
        return given if requires_gradient(given) else None

    def moment(self, step: int, fraction: float) -> Any:
        """Return the time at a fraction of a step; a tensor, in the graph of the lengths, if they are one."""
        interval, place = int(self.interval[step]), self.fraction_of_interval(step, fraction)
        time = float(self.at(interval, place))
        if self.listed is not None:
            return time + (1.0 - fraction) * self._changes[step] + fraction * self._changes[step + 1]
        if not is_tensor(self.interval_length):
            return time
        length = self.interval_length.double()
        return (
            time + (interval + place) * (length - length.detach())
            if length.ndim == 0
            else length.new_tensor(time)
        )

    @cached_property
    def _changes(self) -> Any:
        """The changes of the times at which steps begin, (m + 1,): zeros with the gradient with respect to listed
        lengths.
        """
        import torch

        lengths = self.listed.double()
        return torch.nn.functional.pad((lengths - lengths.detach()).cumsum(0), (1, 0))

    def changes_of_fractions(self, steps: np.ndarray, fractions: np.ndarray) -> Any:
        """Return the changes of places in intervals, at fractions (k,) of steps (k,): zeros with the gradient with
        respect to listed lengths.

        None if places are constant, as in intervals of one step.
        """
        if self.listed is None or len(self) == self.n_intervals:
            return None
        changes, ends, within = self._changes, self.grid_ends, self.interval[steps]
        share = changes.new_tensor(fractions)
        at = changes[steps] * (1.0 - share) + changes[steps + 1] * share
        begin, end = changes[ends[within]], changes[ends[within + 1]]
        place = self.begin[steps] + fractions * (self.end[steps] - self.begin[steps])
        return (at - begin - (end - begin) * changes.new_tensor(place)) / float(self.interval_length)


def _check_shortest(length: float) -> None:
    if length < SHORTEST_STEP:
        raise ValueError(
            f"time_step [s] must be at least {SHORTEST_STEP:g} s, got {length:g}: times of shorter steps are lost in "
            "round-off"
        )


def steps_of(inputs: Inputs, start: Clock, steps: int, time_step: Any) -> TimeSteps:
    """Return the steps of a motion from its arguments. Raises ValueError if they do not fit."""
    if isinstance(time_step, Adaptive):
        return TimeSteps.undivided(inputs, start, steps, time_step)
    if shape_of("time_step [s]", time_step) == ():
        return TimeSteps.equal(inputs, start, steps, time_step)
    inputs.take("time_step", time_step)
    return TimeSteps.from_list(start, steps, time_step)


@dataclass(frozen=True)
class TimePoints:
    """The times at which the core needs values: the start and the stages of each step, one step after another.

    stages: the times of the stages, as fractions of a step.
    """

    steps: TimeSteps
    stages: tuple[float, ...]

    @property
    def fractions(self) -> np.ndarray:
        """The time points of each step as fractions of it, (stages + 1,)."""
        return np.array((0.0, *self.stages))

    @cached_property
    def intervals(self) -> np.ndarray:
        """The interval that each time point is in, (n,)."""
        return np.repeat(self.steps.interval, len(self.fractions))

    @cached_property
    def fractions_of_intervals(self) -> np.ndarray:
        """The time points as fractions of their intervals, (n,)."""
        begin, end = self.steps.begin[:, None], self.steps.end[:, None]
        places = begin + self.fractions * (end - begin)
        places[:, -1] = self.steps.end
        return places.ravel()

    @property
    def times(self) -> np.ndarray:
        """The times of all time points, (n,) s."""
        return self.steps.at(self.intervals, self.fractions_of_intervals)

    @cached_property
    def changes_of_fractions(self) -> Any:
        """The changes of `fractions_of_intervals`: zeros with the gradient with respect to listed lengths of steps; None
        if constant.
        """
        steps = np.arange(len(self.steps)).repeat(len(self.fractions))
        return self.steps.changes_of_fractions(steps, np.tile(self.fractions, len(self.steps)))

    def recorded(self, after: np.ndarray) -> np.ndarray:
        """Return the indices of the states that are recorded after so many steps, the start first."""
        return np.maximum(len(self.fractions) * np.asarray(after) - 1, 0)

    def __len__(self) -> int:
        return len(self.steps) * len(self.fractions)
