"""A value that a function of a few numbers of the action sets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .._checks.arrays import count
from .._checks.quantity import quantity
from .actuator import Actuator


class Steered(Actuator):
    """An Actuator whose numbers in the action are not the value's own, but what a function makes it of: waves along a
    muscle, the speed of a support instead of its place.

    owner, name: as of Actuator. numbers: how many entries of the action, each from -1 to 1.
    value: function of these (numbers,), of the time [s] that the action begins, and of the value before it, that returns
        the value, of its own shape.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    >>> ms.envs.Steered(hinge, "torque", 1, lambda share, time, before: before + 0.1 * share[0])
    Steered(torque of Revolute, by 1 number)
    """

    def __init__(self, owner, name: str, numbers: int, value: Callable):
        super().__init__(owner, name, lower=-1.0, upper=1.0)
        self._numbers = count("numbers", numbers)
        if not callable(value):
            raise ValueError(
                f"value of a Steered must be a function of numbers, time and value before, got {value!r:.60}"
            )
        self._function = value

    @property
    def size(self) -> int:
        """How many numbers of an action it takes."""
        return self._numbers

    def value(self, action: np.ndarray, time: float, before: np.ndarray) -> np.ndarray:
        return quantity(f"what steers {self.name}", "", self._function(action, time, before), self.shape)

    def __repr__(self) -> str:
        numbers = "1 number" if self.size == 1 else f"{self.size} numbers"
        return f"Steered({self.name} of {type(self.owner).__name__}, by {numbers})"
