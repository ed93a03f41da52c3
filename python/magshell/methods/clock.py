"""The time of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .._checks.tensors import detached, is_tensor

if TYPE_CHECKING:
    from .._checks.kinds import Numbers
    from ..dynamics.trajectory import MotionState


@dataclass(frozen=True)
class Clock:
    """Counts steps, so that a motion in parts has the times of one in one piece, to the last bit: sums would not.

    origin: s; time_step: s; steps: that were taken since the origin.
    """

    origin: float
    time_step: float = 0.0
    steps: int = 0

    @property
    def time(self) -> float:
        """s"""
        return self.at(0)

    def at(self, steps: Any, share: Any = 0.0) -> Any:
        """The times [s] when so many more steps, and a share of another, have been taken: numbers or arrays."""
        return self.origin + ((self.steps + steps) + share) * self.time_step

    def after(self, steps: int) -> Clock:
        return Clock(self.origin, self.time_step, self.steps + steps)

    def going_on(self, time_step: float) -> Clock:
        """With other steps counting begins again."""
        return self if self.time_step == time_step else Clock(self.time, time_step)

    def moment(self, steps: Any, share: float, time_step: Numbers) -> Any:
        """As at(); where `time_step` is a tensor, another in its graph, with the time now as it is."""
        time = self.at(steps, share)
        if not is_tensor(time_step):
            return time
        time_step = time_step.double()
        return time + (steps + share) * (time_step - time_step.detach())


def clock_of(state: MotionState) -> Clock:
    """A MotionState's. One whose time was set by hand begins to count there."""
    clock = state.clock
    return clock if clock is not None and clock.time == state.time else Clock(float(detached(state.time)))
