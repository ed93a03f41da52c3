"""The base class of actuators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers

if TYPE_CHECKING:
    from ..scene.scene import Scene


class Actuator(Owner):
    """The base class of actuators: they act in bodies by values that a controller sets, such as activations, pressures,
    volumes or tensions. The values may change during a motion, continuously or by jumps.

    bodies: those that it acts in. is_spring: whether it has a stiffness of its own, which the stiffness of the bodies
    at rest leaves out.
    """

    _for_all = False
    _is_spring = True
    bodies: tuple[Any, ...] = ()
    _units: ClassVar[dict[str, str]] = {}

    def _unit(self, name: str) -> str:
        return self._units[name]

    @property
    def body(self) -> Any:
        """The body, if there is only one, else None."""
        return self.bodies[0] if len(self.bodies) == 1 else None

    def _filling(self, scene: Scene) -> float:
        """Return the fraction of a rest volume that a load factor of 1 adds or removes."""
        return 0.0

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if values over time, (n, ...), contain one that the actuator cannot have."""
        least, most = rows.min(axis=0), rows.max(axis=0)
        for extreme in (least,) if np.array_equal(least, most) else (least, most):
            self.replaced(**{name: extreme})

    def _check_shapes(self, changed: Actuator) -> Actuator:
        """Return a replaced actuator. Raises ValueError if one of its values has another shape."""
        for name in self._replaceable:
            before, after = getattr(self, name), getattr(changed, name)
            if before.shape != after.shape:
                raise ValueError(f"{name} must keep its shape {before.shape}, got {after.shape}")
        return changed


def number(name: str, unit: str, value: Any, least: float | None = None, above: bool = False) -> np.ndarray:
    """Return a finite number as an array (), at least `least`, or above it. Raises ValueError."""
    array = quantity(name, unit, value, ())
    _check_range(name, unit, array, least, above)
    return array


def numbers(name: str, unit: str, value: Any, count: int, what: str, least: float, above: bool) -> np.ndarray:
    """Return finite numbers (count,), from such an array or one number for all. Raises ValueError.

    what: the word for one of the count in messages.
    """
    array = real_numbers(f"{name} [{unit}]", value)
    if array.shape not in ((), (count,)):
        raise ValueError(f"{name} [{unit}] must be a number or one a {what}, ({count},), got {array.shape}")
    array = quantity(name, unit, np.broadcast_to(array, (count,)), (count,))
    _check_range(name, unit, array, least, above)
    return array


def _check_range(name: str, unit: str, array: np.ndarray, least: float | None, above: bool) -> None:
    if least is None:
        return
    smallest = float(array.min(initial=np.inf))
    if smallest < least or (above and smallest == least):
        wanted = f"above {least:g}" if above else f"at least {least:g}"
        raise ValueError(f"{name} [{unit}] must be {wanted}, got {smallest:g}")
