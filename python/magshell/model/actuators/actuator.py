"""What a scene's `actuators` have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers

if TYPE_CHECKING:
    from ..scene.scene import Scene


class Actuator(Owner):
    """Works in bodies by numbers that a controller sets: activations, pressures, volumes, tensions. They may change during
    a motion, at once or gradually.

    bodies: those that it works in. is_spring: whether it has a stiffness of its own, which that of the bodies at rest leaves
    out.
    """

    _for_all = False
    _is_spring = True
    bodies: tuple[Any, ...] = ()
    _units: ClassVar[dict[str, str]] = {}

    def _unit(self, name: str) -> str:
        return self._units[name]

    @property
    def body(self) -> Any:
        """The one body, or None where there are several."""
        return self.bodies[0] if len(self.bodies) == 1 else None

    def _filling(self, scene: Scene) -> float:
        """How much of a volume at rest a load factor of 1 adds to it, or takes away."""
        return 0.0

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raises ValueError where it cannot have one of the numbers (n, ...) over time."""
        least, most = rows.min(axis=0), rows.max(axis=0)
        for extreme in (least,) if np.array_equal(least, most) else (least, most):
            self.replaced(**{name: extreme})

    def _keep_shapes(self, changed: Actuator) -> Actuator:
        for name in self._replaceable:
            before, after = getattr(self, name), getattr(changed, name)
            if before.shape != after.shape:
                raise ValueError(f"{name} must keep its shape {before.shape}, got {after.shape}")
        return changed


def number(name: str, unit: str, value: Any, least: float | None = None, above: bool = False) -> np.ndarray:
    """A finite number as an array (), at least `least`, or above it. Raises ValueError."""
    array = quantity(name, unit, value, ())
    _check_range(name, unit, array, least, above)
    return array


def numbers(name: str, unit: str, value: Any, count: int, what: str, least: float, above: bool) -> np.ndarray:
    """Finite numbers, one a cell (count,), given so or as one of all. Raises ValueError."""
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
