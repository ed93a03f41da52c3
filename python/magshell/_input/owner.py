"""Base class of the scene's objects whose parameters enter the core's parameter vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._runtime.frozen import Frozen
from .._runtime.solver_entry_point import grouped


class Owner(Frozen):
    """An object whose replaceable parameters have the same names in the core.

    A subclass whose parameters differ from the core's overrides both `_add_numbers` and `_gradients`: each is the
    transpose of the other.
    """

    def __init_subclass__(cls, **options: Any) -> None:
        """Wrap the constructor so that an unknown keyword raises an error that lists the known ones."""
        if "__init__" in vars(cls) and not hasattr(cls.__init__, "__wrapped__"):
            setattr(cls, "__init__", grouped()(cls.__init__))  # noqa: B010 - assigned, it were declared to type checkers
        super().__init_subclass__(**options)

    _replaceable: tuple[str, ...] = ()
    _in_time: tuple[str, ...] = ()  # parameters that may change during a motion

    def _add_numbers(self, label: str, values: Any, numbers: dict[tuple[str, str], np.ndarray]) -> None:
        """Write the parameters into `numbers`, by (label, name).

        label: the name of this object in the solve; values: the parameters given to the solve.
        """
        for name in self._replaceable:
            numbers[label, name] = getattr(self, name)

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if a row of `rows` (n, ...) is not allowed for this parameter during a motion."""

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        """Return the gradients with respect to the object's own parameters, from the core's gradient; one row for each of
        its parts."""
        return {name: gradient.value(label, name) for name in self._replaceable}
