"""The base of springs and elastic foundations: their values, and the forces of linear springs between points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.given_values import as_given
from ..._input.owner import Owner
from ..._input.quantity import quantity, real_numbers
from ..._input.tensors import stacked
from ..._runtime.frozen import Frozen, variant

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..._input.kinds import Computed, Numbers, SolveResult
    from ..bodies.bodies import Bodies


class Springs(Owner, ABC):
    """The base class of springs: linear elements of the structure, which the load factor does not scale.

    stiffness, damping: a number for all springs, or one for each. `_replaceable` names the values that can be replaced.
    """

    _for_all = False  # springs name their bodies: none acts on all bodies of a scene
    _follows: tuple[str, ...] = ()  # the values that follow from where the ends are at rest
    stiffness: np.ndarray
    damping: np.ndarray | None

    def replaced(self, **values: Any) -> Any:
        """Return the same springs with other values, of the same shapes."""
        found = self._made({name: getattr(self, name) for name in self._replaceable} | values)
        return variant(found, _follows=tuple(name for name in self._follows if name not in values))

    @abstractmethod
    def _made(self, values: dict[str, Any]) -> Any:
        """Return the same springs with these values; each kind has its own arguments."""

    def _check_shapes(self, changed: Springs) -> Springs:
        """Return replaced springs. Raises ValueError if one of their values has another shape."""
        for name in self._replaceable:
            before, after = getattr(self, name).shape, getattr(changed, name).shape
            if before != after:
                raise ValueError(f"{name} of {self!r} must keep its shape {before}, got {after}")
        return changed

    def _check_in_time(self, name: str, rows: np.ndarray) -> None:
        """Raise ValueError if values over time, (n, ...), contain one that springs cannot have."""
        # The numbers that springs can have are intervals, so the extremes of each entry suffice.
        least, most = rows.min(axis=0), rows.max(axis=0)
        for extreme in (least,) if np.array_equal(least, most) else (least, most):
            self.replaced(**{name: extreme})

    def _gradients(self, label: str, values: Any, gradient: Any) -> dict[str, np.ndarray]:
        shapes = {name: getattr(self, name).shape for name in self._replaceable}
        return {name: gradient.value(label, name).reshape(shape) for name, shape in shapes.items()}

    def _rows(self, name: str, follows: bool = False) -> int:
        """Return the number of rows of a value in the core: 0 if there is none of this name.

        follows: whether it has those values too that follow from rest positions and cannot be replaced.
        """
        if name not in self._replaceable and not (follows and name in self._follows):
            return 0
        shape = getattr(self, name).shape
        # A point of the ground is a row of three numbers; every other value is a number. One for all has a dimension less.
        return shape[0] if len(shape) > (name == "ground") else 1


class SpringsResult(Frozen):
    """The base class of the results of springs."""

    def __init__(self, result: SolveResult, springs: Springs):
        if not any(springs is each for each in result.scene.loads):
            raise ValueError(f"springs of the scene are among scene.loads, got {springs!r} that is not in it")
        self._result, self._springs = result, springs

    def _in_each_state(self, law: Callable[..., Any], *of_states: Any) -> Computed:
        """Return law(springs, x, ...) for each state, with the springs as they were in it and the rows of `of_states`."""
        if np.ndim(self._result._load_factors) == 0:
            return law(self._at(0), *of_states)
        count = len(of_states[0])
        return stacked([law(self._at(k), *(each[k] for each in of_states)) for k in range(count)])

    def _at(self, k: int) -> Any:
        """Return the springs as they were in a state, with tensors for the values that were given so."""
        return as_given(self._result, self._springs, k)

    def _velocities(self) -> Any:
        """Return the velocities of the result's vertices; None if it has none or the springs have no damping."""
        return None if self._springs.damping is None else getattr(self._result, "velocities", None)

    def __repr__(self) -> str:
        return f"{type(self._result).__name__} of {self._springs!r}"


def numbers_of_springs(name: str, unit: str, value: Numbers, count: int | None, each: str) -> np.ndarray:
    """Return finite numbers of at least zero, () for all or (count,). Raises ValueError.

    count: None accepts any length. each: what there are `count` of, in the singular, for the message.
    """
    array = real_numbers(f"{name} [{unit}]", value)
    if array.ndim > 1 or (array.ndim == 1 and count is not None and len(array) != count):
        wanted = f"({'k' if count is None else count},)"
        raise ValueError(
            f"{name} [{unit}] must be a number or one for each {each}, {wanted}, got shape {array.shape}"
        )
    if array.size == 0:
        raise ValueError(f"{name} [{unit}] is empty")
    array = quantity(name, unit, array, array.shape)
    if array.min() < 0.0:
        raise ValueError(f"{name} [{unit}] must be at least 0, got {array.min():g}")
    return array


def axes(direction: np.ndarray | None) -> list[np.ndarray]:
    """Return the unit vectors along which springs act: `direction`, or those of all three axes."""
    return list(np.eye(3)) if direction is None else [direction]


def unit_vector(name: str, value: Numbers | None) -> np.ndarray | None:
    """Return a direction (3,) with length 1, or None. Raises ValueError for a vector of no length."""
    if value is None:
        return None
    vector = quantity(name, "1", value, (3,))
    if not np.linalg.norm(vector) > 0.0:
        raise ValueError(f"{name} must not be zero")
    return vector / np.linalg.norm(vector)


def scene_vertices(bodies: Bodies, springs: Springs, vertices: np.ndarray) -> np.ndarray:
    """Return vertices of the body of `springs` in the numbers of the scene; welded ones are those they are welded to."""
    return bodies.original[bodies.of(springs).vertices][vertices]
