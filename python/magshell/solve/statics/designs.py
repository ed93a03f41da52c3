"""The arguments of ms.equilibrium as numbers: half-way designs, and designs in a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._input.quantity import real_numbers
from ..._input.tensors import detached

if TYPE_CHECKING:
    from ...model.scene.scene import Scene


def numbers_only(design: dict[Any, Any]) -> dict[Any, Any]:
    """Copy a design as arrays of numbers, without tensors' graphs and without arguments that are None."""
    kept = {name: value for name, value in design.items() if value is not None}
    return {
        name: {owner: numbers_only(named) for owner, named in value.items()}
        if isinstance(value, dict)
        else real_numbers(name, detached(value))
        for name, value in kept.items()
    }


def between(old: dict[Any, Any], new: dict[Any, Any], fraction: float) -> dict[Any, Any]:
    """Interpolate linearly between two designs. Raises ValueError if they do not have the same arguments."""
    if old.keys() != new.keys():
        names = ", ".join(sorted(str(name) for name in old.keys() ^ new.keys()))
        raise ValueError(f"this design and the last one differ in which arguments they have: {names}")
    return {
        name: between(value, new[name], fraction)
        if isinstance(value, dict)
        else value + fraction * (new[name] - value)
        for name, value in old.items()
    }


def packed(scene: Scene, design: dict[Any, Any], form: Callable[[np.ndarray], Any]) -> dict[Any, Any]:
    """Return a design with indices instead of the scene's objects, and form(array) instead of each array."""
    objects, own = (
        [id(each) for each in _objects(scene)],
        {name: value for name, value in design.items() if name != "values"},
    )
    values = {objects.index(id(owner)): named for owner, named in design.get("values", {}).items()}
    return {
        **{name: form(array) for name, array in own.items()},
        "values": {
            number: {name: form(array) for name, array in named.items()} for number, named in values.items()
        },
    }


def unpacked(scene: Scene, design: dict[Any, Any]) -> dict[Any, Any]:
    """Restore a design from the result of `packed`. Raises ValueError if the scene lacks an object."""
    objects = _objects(scene)
    if any(number >= len(objects) for number in design["values"]):
        raise ValueError("this state is of another scene: it has values of more objects than there are here")
    values = {objects[number]: named for number, named in design["values"].items()}
    return numbers_only({**design, "values": values or None})


def _objects(scene) -> list[Any]:
    return [scene, *scene.objects]
