"""Component of an action that sets a value through a function of a few numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .._input.arrays import count
from .._input.quantity import quantity
from .._input.tensors import is_tensor, real_tensor
from .action import Action

if TYPE_CHECKING:
    from ..model.scene.scene import Scene


class ParametricAction(Action):
    """An Action whose numbers are arguments of a function that computes the value.

    Examples: waves along a muscle, or the speed of a support instead of its position.

    owner, name: as of Action; or a list of several owners whose values have one shape and are set together: the value is
        then (owners, ...), one row for each. numbers: number of entries of the action, each from -1 to 1.
    value: function of these (numbers,), of the time [s] at which the action begins, and of the value before it, that
        returns the value.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    >>> ms.envs.ParametricAction(hinge, "torque", 1, lambda numbers, time, before: before + 0.1 * numbers[0])
    ParametricAction(torque of Revolute, by 1 number)
    """

    def __init__(self, owner: Any, name: str, numbers: int, value: Callable[..., Any]):
        self._several = isinstance(owner, list | tuple)
        if self._several and not owner:
            raise ValueError("owner of a ParametricAction must be one object or a list of at least one")
        super().__init__(owner[0] if self._several else owner, name, lower=-1.0, upper=1.0)
        self._further = (
            [Action(each, name, lower=-1.0, upper=1.0) for each in owner[1:]] if self._several else []
        )
        for each in self._further:
            if each.shape != self.shape:
                raise ValueError(
                    f"{name} of all owners of a ParametricAction must have one shape, got {self.shape} and {each.shape}"
                )
        self._numbers = count("numbers", numbers)
        if not callable(value):
            raise ValueError(
                f"value of a ParametricAction must be a function of numbers, time and value before, got {value!r:.60}"
            )
        self._function = value

    @property
    def size(self) -> int:
        """The number of entries of the action that the function takes."""
        return self._numbers

    @property
    def owners(self) -> tuple[Any, ...]:
        """The objects whose value is set, one by one."""
        return (self.owner, *(each.owner for each in self._further))

    @property
    def _at_start(self) -> np.ndarray:
        """The value in the scene before any action; with several owners one row each."""
        first = super()._at_start
        return np.stack([first, *(each._at_start for each in self._further)]) if self._several else first

    def _check_in(self, scene: Scene) -> None:
        super()._check_in(scene)
        for each in self._further:
            each._check_in(scene)

    def value(self, action: Any, time: float, before: Any) -> Any:
        shape = (len(self.owners), *self.shape) if self._several else self.shape
        if is_tensor(action):
            before = before if is_tensor(before) else action.new_tensor(before)
            return real_tensor(f"what steers {self.name}", self._function(action, time, before), shape)
        return quantity(f"what steers {self.name}", "", self._function(action, time, before), shape)

    def _all_time_series(self, before: Any, now: Any, steps: int) -> list[Any]:
        if not self._several:
            return super()._all_time_series(before, now, steps)
        return [self._time_series(old, new, steps) for old, new in zip(before, now, strict=True)]

    def __repr__(self) -> str:
        numbers = "1 number" if self.size == 1 else f"{self.size} numbers"
        kind = type(self.owner).__name__
        return f"ParametricAction({self.name} of {f'{len(self.owners)} {kind}' if self._several else kind}, by {numbers})"
