"""Continuation of equilibria from one design to the next, with a check for jumps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ... import _core
from ..._input.quantity import real_numbers
from ..._input.tensors import detached, require_torch
from ...errors import EquilibriumJumped, NotConverged
from ...model.scene.fine_faces import fine_faces, having_fine_faces
from ...model.scene.reshaped import REST, directions_of, renumbered_vector, reshaped
from .single_solve import Search, Solution, find, inputs_of
from .start import Origin, state_in

if TYPE_CHECKING:
    from ...model.scene.scene import Scene

_MAX_DEVIATION = (
    0.5  # [-] largest deviation from the first-order change, over that change; beyond it a step is halved
)
_NO_JUMP = 1e-3  # [-] deviation, over the extent of the bodies, that never counts as a jump
_SHORTEST_STEP = 1.0 / 32.0  # [-] of the change of the design


class ReachedEquilibrium(NamedTuple):
    """An equilibrium that was found, and the numbers of its design."""

    solution: Solution
    design: dict[Any, Any]


class DesignContinuation:
    """Finds the equilibrium of each design from that of the last one, for one load case or one member of a batch.

    last: the equilibrium stored last, None at first. solves: the number of solves so far.
    """

    def __init__(self, scene: Scene, start: Any, search: Search):
        self._scene, self._start, self._search = scene, start, search
        self.last: ReachedEquilibrium | None = None
        self.solves: int = 0

    def find(
        self,
        arguments: dict[Any, Any],
        accept_jumps: bool,
        progress: Callable[[float, float], None] | None = None,
    ) -> ReachedEquilibrium:
        """Find the equilibrium of a design, without storing it. Raises EquilibriumJumped and the errors of a solve."""
        search = replace(self._search, progress=progress)
        if self.last is None:
            solution = self._solved(arguments, self._start, search)
        elif accept_jumps:
            solution = self._solved(arguments, self.last.solution.equilibrium, search)
        else:
            solution = self._in_steps(self.last, arguments, search)
        return ReachedEquilibrium(solution, numbers_only(arguments))

    def store(self, reached: ReachedEquilibrium) -> None:
        """Store this equilibrium, from which the next call starts."""
        self.last = reached

    def state(self) -> tuple[dict[str, Any], dict[Any, Any]]:
        """Return the state and the design for `restore`, as tensors and plain values."""
        torch = require_torch("a state_dict")
        solution, design = self._stored
        state = {
            "state": torch.tensor(solution.found.state),
            "angle_branches": solution.found.angle_branches,
            # which faces sample the applied field finely (model/scene/fine_faces.py)
            "fine_faces": torch.from_numpy(fine_faces(solution.inputs.values)),
        }
        return state, packed(self._scene, design, torch.from_numpy)

    def restore(self, state: dict[str, Any], design: dict[Any, Any]) -> None:
        """Continue from what `state` of another object returned, with bitwise the same results."""
        arguments = unpacked(self._scene, design)
        scene, values = reshaped(self._scene, arguments.get("values"))
        inputs = inputs_of(scene, {**arguments, "values": values})
        inputs = having_fine_faces(inputs, state["fine_faces"].numpy())
        origin = Origin(state["state"].numpy(), state["angle_branches"], inputs)
        solution = find(self._scene, arguments, origin, self._search, store_factor=True)
        self.last = ReachedEquilibrium(solution, arguments)

    @property
    def _stored(self) -> ReachedEquilibrium:
        if self.last is None:
            raise ValueError("this WarmStart has no equilibrium yet")
        return self.last

    def _solved(self, arguments: dict[Any, Any], start: Any, search: Search) -> Solution:
        self.solves += 1
        return find(self._scene, arguments, start, search, store_factor=True)

    def _in_steps(self, last: ReachedEquilibrium, arguments: dict[Any, Any], search: Search) -> Solution:
        """Find the equilibrium of a new design, in steps along the straight line from the last design to it.

        A step is halved until its equilibrium is near the one that the first-order change predicts.
        """
        solution, new = last.solution, numbers_only(arguments)
        at, step = 0.0, 1.0
        while at < 1.0:
            to = min(1.0, at + step)
            trial = self._tried(solution, arguments if to == 1.0 else between(last.design, new, to), search)
            if trial is not None:
                solution, at, step = trial, to, 2.0 * step
            elif step > _SHORTEST_STEP:
                step = max(0.5 * (to - at), _SHORTEST_STEP)
            else:
                raise EquilibriumJumped(
                    f"the equilibrium jumps at {at:.3g} to {to:.3g} of the way from the last design to this one: "
                    "it buckles or snaps. Take a shorter step, or go through it with accept_jumps().",
                    last.solution.equilibrium,
                )
        return solution

    def _tried(self, last: Solution, arguments: dict[Any, Any], search: Search) -> Solution | None:
        """Find the next equilibrium; return None if it does not continue the last one."""
        try:
            new = self._solved(arguments, last.equilibrium, search)
        except NotConverged:
            return None
        if new.equilibrium.saddles_escaped or new.equilibrium.relaxation_steps:
            return None
        return new if self._continues(last, new) else None

    def _continues(self, last: Solution, new: Solution) -> bool:
        """Return whether the new equilibrium is near the one that the first-order change predicts."""
        model, last_model = new.inputs.scene._model, last.inputs.scene._model
        if model is last_model:
            with new.inputs.in_core():
                change = _core.first_order_change(model, last.found, new.inputs.load_parameters)
            expected = model.positions(change)
        else:  # other rest positions
            expected = _first_order_change(last, new)
        moved = model.positions(new.found.state) - last_model.positions(last.found.state)
        deviation, size = _largest(moved - expected), _largest(expected)
        return deviation <= max(_MAX_DEVIATION * size, _NO_JUMP * self._scene._bodies.extent)


def _first_order_change(last: Solution, new: Solution) -> np.ndarray:
    """Return the change of positions to first order, from an equilibrium to one with other rest positions, (n_v, 3) m.

    It is the response of the last equilibrium to the forces, and to the motions of supports, that the new scene has at the
    last positions. The two scenes number their unknowns differently, so both are transferred by vertices and edges.
    """
    last_scene, new_scene = last.inputs.scene, new.inputs.scene
    if (directions := directions_of(new_scene)) != directions_of(last_scene):
        raise ValueError(f"{REST} must be given in every call of a WarmStart, or in none")
    state, model = state_in(new_scene, last.equilibrium), new_scene._model
    with new.inputs.in_core():
        gradient = model.gradient(state, new.inputs.load_parameters)
        increment = model.driven_increment(state, new.inputs.load_parameters)
    gradient_change = renumbered_vector(last_scene, new_scene, gradient)
    prescribed = renumbered_vector(last_scene, new_scene, increment)
    prescribed[directions] = increment[directions]  # which renumbered_vector sets to zero
    with last.inputs.in_core():
        change = _core.push_forward(last_scene._model, last.found, gradient_change, prescribed)
        return last_scene._model.positions(change)


def _largest(displacements: np.ndarray) -> float:
    return float(np.sqrt((displacements**2).sum(axis=1).max()))


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
