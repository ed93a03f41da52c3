"""Values that change along a path of equilibria, linearly from those of its start to those of its end."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from ...model.contact.obstacles import Obstacle
from ...model.scene.element_sampling import KEY
from ...model.scene.solve_inputs import Inputs
from ...model.scene.time_varying import names_in_time, values_between
from ...model.scene.values import Values
from ...model.supports.supports import Support

if TYPE_CHECKING:
    from ...model.scene.scene import Scene
    from .start import Origin


class AlongPath:
    """The values of a solve that change linearly from those at `start` (an Equilibrium, or None) to those of the inputs.

    entries: indices of the changing values in the core's vector of values; before, after: their numbers at both ends, which
    follow the load parameters.
    at_once: only obstacles and supports move along the path; everything else has its final value from the start on.
    Otherwise raises ValueError if a value differs that cannot change along a path.
    """

    after: np.ndarray
    before: np.ndarray

    def __init__(self, inputs: Inputs, start: Origin, at_once: bool = False):
        self._layout = inputs.scene._value_layout
        self._after = inputs.values
        self._before = inputs.values if start is None else start._values
        differ = _differing(self._layout, self._before, self._after)
        can = _keys_that_move(inputs)
        if at_once:
            differ = [key for key in differ if isinstance(can.get(key), Obstacle | Support)]
        if fixed := [name for owner, name in differ if (owner, name) not in can]:
            raise ValueError(
                f"start has another {fixed[0]} than the path, which cannot change on its way; what can is the place of "
                "field sources, obstacles and supports, pressures, what acts in joints, activations of muscles and growth"
            )
        self._keys = differ
        every = list(self._layout)
        self.entries: list[int] = [every.index(key) for key in differ]
        self._owners = {id(can[key]): can[key] for key in differ}
        self.before, self.after = (
            np.concatenate([np.zeros(0), *(self._part(values, key).ravel() for key in differ)])
            for values in (self._before, self._after)
        )

    def obstacles(self) -> tuple[Obstacle, ...]:
        """Return the obstacles that move along the path, or all if supports move."""
        if any(isinstance(owner, Support) for owner in self._owners.values()):
            return self._after.scene.obstacles
        return tuple(owner for owner in self._owners.values() if isinstance(owner, Obstacle))

    def values(self, parameter: float) -> Values:
        """Return the values of the scene at a parameter of the path, 0 to 1."""
        if not self.entries or parameter == 1.0:
            return self._after
        there = copy.copy(self._after)
        parts = [[self._part(values, key) for values in (self._before, self._after)] for key in self._keys]
        there.numbers = self._layout.packed(
            {
                key: (1.0 - parameter) * before + parameter * after
                for key, (before, after) in zip(self._keys, parts, strict=True)
            },
            self._after.numbers,
        )
        there._now, there.replaced = dict(self._after._now), dict(self._after.replaced)
        for owner in self._owners.values():
            ends = [values.current(owner) for values in (self._before, self._after)]
            named = values_between(*ends, parameter)
            there._now[owner] = ends[1].replaced(**named)
            there.replaced[owner] = {**there.replaced.get(owner, {}), **named}
        if any(isinstance(owner, Support) for owner in self._owners.values()):
            there.constraints = there._moved()
        return there

    def _part(self, values: Values, key: tuple[str, str]) -> np.ndarray:
        return self._layout.of(values.numbers, *key)


def moving_obstacles(
    scene: Scene, along: AlongPath | None, before: np.ndarray, after: np.ndarray
) -> tuple[Obstacle, ...]:
    """Return the obstacles that move between two sets of load parameters, and with `along`; all if supports move."""
    factors = [scene._load_parameter_layout.of(each, "scene", "support_factor") for each in (before, after)]
    moves = [np.any(move.rotation) or np.any(move.translation) for move in scene._constraints.moves]
    if any(moves) and not np.array_equal(*factors):
        return scene.obstacles
    return along.obstacles() if along is not None else ()


def all_can_move(inputs: Inputs, start: Origin) -> bool:
    """Return whether all values in which `start` differs from the inputs can change along a path."""
    can = _keys_that_move(inputs)
    return all(key in can for key in _differing(inputs.scene._value_layout, start._values, inputs.values))


def _differing(layout, before: Values, after: Values) -> list[tuple[str, str]]:
    return [
        key
        for key in layout
        if key[1] != KEY  # which faces sample finely is as at the end, all along the path
        and not np.array_equal(layout.of(before.numbers, *key), layout.of(after.numbers, *key))
    ]


def _keys_that_move(inputs: Inputs) -> dict[tuple[str, str], object]:
    """Return the values that can change along a path, {(label of an object in the core, name of a value): the object}."""
    scene = inputs.scene
    can = {(label, name): each for each, label in scene._labels for name in names_in_time(each)}
    for k, move in enumerate(scene._constraints.moves):
        can |= {(f"move {k}", name): move.support for name in names_in_time(move.support)}
    return can
