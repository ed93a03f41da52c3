"""Component of an environment's action: a value of one of the scene's objects, between bounds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._input.quantity import quantity
from .._input.tensors import is_tensor
from .._runtime.frozen import Frozen
from .._runtime.keywords import FLUX_DENSITY, LOAD_PARAMETERS, load_parameters_of, nearest_first
from ..model.scene.time_varying import may_jump, names_in_time, row_in_time

if TYPE_CHECKING:
    from .._input.kinds import Numbers
    from ..model.scene.scene import Scene


class Action(Frozen):
    """A value that actions set. Its numbers are entries of the action, which run from -1 at `lower` to 1 at `upper`.

    owner: the scene, for applied_flux_density [T] and the factors of ms.simulate; or one of its objects, for values that
        may change during a motion: the torque of a joint, the displacement of a clamp, the moments of Dipoles, ...
    lower, upper: bounds in the value's own unit, numbers or of its shape. An entry whose bounds are equal stays there and
        takes no number: lower=(0, 0, -0.01), upper=(0, 0, 0.01) is a field along z.

    Fields and joint torques are constant while an action lasts. Values that move something (supports, obstacles, sources)
    change linearly from the value of the action before, at first from the value in the scene.

    name: of the value.

    >>> import magshell as ms
    >>> bob = ms.Link(mass=1.0, center=(0, 0, -1.0), inertia=0.1)
    >>> hinge = ms.Revolute(bob, origin=(0, 0, 0), axis=(0, 1, 0), torque=0.0)
    >>> ms.envs.Action(hinge, "torque", lower=-2.0, upper=2.0)
    Action(torque of Revolute, 1 number from -2 to 2)
    """

    name: str
    owner: Any
    lower: np.ndarray
    upper: np.ndarray

    def __init__(self, owner: Any, name: str, *, lower: Numbers, upper: Numbers):
        self.owner, self.name = owner, name
        self._of_scene = hasattr(owner, "bodies") and hasattr(owner, "supports")
        if self._of_scene:
            known = LOAD_PARAMETERS
            self.shape: tuple[int, ...] = (3,) if name == FLUX_DENSITY else ()
        else:
            known = names_in_time(owner)
            self.shape = row_in_time(owner, name) or ()
        if name not in known:
            has = f"it has {nearest_first(name, known)}" if known else "it has none"
            raise ValueError(
                f"{type(owner).__name__} has no value {name!r} that may change during a motion: {has}"
            )
        self.lower, self.upper = (
            np.broadcast_to(quantity(each, "", value, np.shape(value)), self.shape)
            if np.shape(value) in ((), self.shape)
            else self._refuse(each, value)
            for each, value in (("lower", lower), ("upper", upper))
        )
        if not self._of_scene and self._of_owner is None:
            raise ValueError(f"the {type(owner).__name__} was made without {name}: give it one, zero will do")
        if (self.lower > self.upper).any() or not (self.lower < self.upper).any():
            raise ValueError(
                f"lower of an Action must be below upper (an entry with equal bounds stays there), got {lower} and {upper}"
            )
        self._free = np.flatnonzero(np.reshape(self.lower < self.upper, -1))

    def _refuse(self, which: str, value):
        """Raise ValueError: a bound has the wrong shape."""
        raise ValueError(
            f"{which} of {self.name} must be a number or have shape {self.shape}, got {np.shape(value)}"
        )

    @property
    def owners(self) -> tuple[Any, ...]:
        """The objects whose value is set."""
        return (self.owner,)

    @property
    def size(self) -> int:
        """The number of entries of the action that the value takes: one for each entry whose bounds differ."""
        return self._free.size

    @property
    def _at_start(self) -> np.ndarray:
        """The value in the scene before any action: zero for a field, one for a factor."""
        if self._of_scene:
            return np.zeros(3) if self.name == FLUX_DENSITY else np.array(1.0)
        return np.array(self._of_owner, dtype=np.float64).reshape(self.shape)

    @property
    def _of_owner(self):
        """The value that its owner has, or None."""
        return getattr(getattr(self.owner, "_move", self.owner), self.name, None)

    def _check_in(self, scene: Scene) -> None:
        """Raise ValueError unless the owner is the scene or one of its objects."""
        if not any(self.owner is each for each in (scene, *scene.objects)):
            raise ValueError(f"{self!r} is about something that is neither the scene nor one of its objects")
        if self._of_scene and self.name not in load_parameters_of(self.owner, scene):
            raise ValueError(f"the scene has no {self.name}")

    def value(self, action: Any, time: float, before: Any) -> Any:
        """Return the value for its entries of an action, (size,) in -1 to 1, which begins at a time [s] with the
        value `before`. A tensor gives a tensor."""
        fraction = 0.5 * (self._all_entries(action).reshape(self.shape) + 1.0)
        lower, reach = self.lower, self.upper - self.lower
        if is_tensor(action):
            lower, reach = fraction.new_tensor(lower), fraction.new_tensor(reach)
        return lower + fraction * reach

    def _all_entries(self, action: Any) -> Any:
        """Return the action with zeros for the entries that are fixed."""
        entries = int(np.prod(self.shape))
        if self.size == entries:
            return action
        rows = np.eye(entries)[:, self._free]
        return (action.new_tensor(rows) if is_tensor(action) else rows) @ action

    def _all_time_series(self, before: Any, now: Any, steps: int) -> list[Any]:
        """Return the values of each owner during an action, as ms.simulate takes them.

        A value that may jump is constant, (steps, ...); another one is linear in time, (steps + 1, ...).
        """
        return [self._time_series(before, now, steps)]

    def _time_series(self, before: Any, now: Any, steps: int) -> Any:
        """Return the values of one owner during an action, constant or linear in time."""
        if self._of_scene or may_jump(self.owner):
            shape = (steps, *self.shape)
            return now.expand(shape) if is_tensor(now) else np.broadcast_to(now, shape)
        fractions: Any = np.linspace(0.0, 1.0, steps + 1).reshape(-1, *(1 for _ in self.shape))
        if is_tensor(now):
            fractions = now.new_tensor(fractions)
            before = before if is_tensor(before) else now.new_tensor(before)
        return (1.0 - fractions) * before + fractions * now

    def __repr__(self) -> str:
        numbers = "1 number" if self.size == 1 else f"{self.size} numbers"
        return (
            f"Action({self.name} of {type(self.owner).__name__}, {numbers} "
            f"from {self.lower.min():g} to {self.upper.max():g})"
        )
