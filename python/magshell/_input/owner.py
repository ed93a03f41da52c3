"""What an object of a scene is to the core's vector of values."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._runtime.frozen import Frozen
from .._runtime.solver_entry_point import grouped


class Owner(Frozen):
    """An object whose replaceable values are the core's under the same names. Others override the two methods, together:
    each is the transpose of the other."""

    def __init_subclass__(cls, **options: Any) -> None:
        """A keyword that its constructor does not have is told with those that it has."""
        if "__init__" in vars(cls) and not hasattr(cls.__init__, "__wrapped__"):
            setattr(cls, "__init__", grouped()(cls.__init__))  # noqa: B010 - assigned, it were declared to type checkers
        super().__init_subclass__(**options)

    _replaceable: tuple[str, ...] = ()
    _in_time: tuple[str, ...] = ()  # those that may change during a motion

    def _add_numbers(self, label: str, values: Any, numbers: dict[tuple[str, str], np.ndarray]) -> None:
        """Puts its numbers in place, by owner and name. values: those of the solve; label: its own name there."""
        for name in self._replaceable:
            numbers[label, name] = getattr(self, name)

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raises ValueError where it cannot have one of the numbers (n, ...) over time."""

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        """By its values, from the core's gradient; a row for each of its parts."""
        return {name: gradient.value(label, name) for name in self._replaceable}
