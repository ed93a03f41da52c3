"""The stiffness of a scene at its rest shape, unloaded, for linear theory."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import _core
from ...model.actuators.muscle import FibreStates, muscles_in
from ...model.loads.custom_energy import CustomEnergy
from ...model.loads.springs import Springs
from ...model.scene.solve_inputs import Inputs
from .stiffness import Stiffness, refuse_indefinite

_ROUND_OFF = 1e-9  # of a muscle's strength


class RestStiffness(Stiffness):
    """The Hessian K at the rest shape without loads.

    Raises ValueError if actuators are springs of their own, which are no part of K, or if muscles pull or shells have grown
    (`refuse_what_acts`); when K is factorized, if it is not positive definite: the scene is not held, or not stable.
    """

    def __init__(self, inputs: Inputs):
        scene = inputs.scene
        refuse_springs(inputs)
        refuse_what_acts(inputs)
        super().__init__(scene, scene._model.rest_state(), scene._load_parameter_layout.zeros(), "at rest")

    def response(self, inputs: Inputs, at_rest: np.ndarray | None = None) -> np.ndarray:
        """Return du of all degrees of freedom: K du = g(0) - g(c) - K dm, with dm the motion of supports and motors.

        Unless the whole of K is factorized already, only the part that is coupled with a load is factorized, and the rest of
        K may be singular.

        at_rest: g(0) from `forces_at_rest`; by default with the forces of joints, which are no load then.
        """
        model, layout = self._model, inputs.scene._load_parameter_layout
        if not self.factorized:
            found = model.small_deflection(self.state, self.load_parameters, inputs.load_parameters, at_rest)
            if not len(motion := found.motion):
                refuse_indefinite(found.report, found.unknowns, self.where)
            return motion
        moved = model.prescribed_rate(self.load_parameters) * layout.of(
            inputs.load_parameters, "scene", "support_factor"
        )
        moved = moved + model.driven_increment(self.state, self.load_parameters)
        forces = (self.gradient if at_rest is None else at_rest) - model.gradient(
            self.state, inputs.load_parameters
        )
        return self.answer(forces, moved)


def refuse_springs(inputs: Inputs) -> None:
    """Raise ValueError if an actuator is a spring of its own."""
    if springs := [each for each in map(inputs.values.current, inputs.scene.actuators) if each._is_spring]:
        raise ValueError(
            f"linear theory takes the stiffness at rest without what acts there, and {springs[0]!r} is a spring that "
            "acts: ms.equilibrium, ms.follow_path, ms.vibration_modes and ms.linear_response about an equilibrium have it"
        )


def pulling_parts(inputs: Inputs) -> dict[Any, Any]:
    """Return the joints and rigid bodies that pull at rest, {object of the scene: the same without what pulls}."""
    scene = inputs.scene
    parts = {own: inputs.values.current(own) for own in (*scene.joints, *scene.rigid_parts)}
    return {own: part._resting for own, part in parts.items() if part._resting is not part}


def forces_at_rest(inputs: Inputs) -> np.ndarray | None:
    """Return g(0) of all degrees of freedom at the rest shape without what pulls in joints and on rigid bodies, so that
    this becomes a load.

    Return None if nothing pulls.
    """
    if not (pulling := pulling_parts(inputs)):
        return None
    scene = inputs.scene
    with inputs.values.with_objects(pulling).in_core():
        return scene._model.gradient(scene._model.rest_state(), scene._load_parameter_layout.zeros())


def refuse_what_acts(inputs: Inputs) -> None:
    """Raise ValueError if the rest shape is no equilibrium: a muscle, springs or a CustomEnergy pull there, or a shell has
    grown.
    """
    model = inputs.scene._model
    _refuse_custom_forces(inputs)
    for own in inputs.scene._bodies.shells:
        for crease in map(inputs.values.current, own.creases):
            if crease._pulls_in(own.mesh):
                raise ValueError(
                    f"{crease!r} pulls at the rest shape, which is no equilibrium then: find one with ms.equilibrium, and "
                    "hand it over as `equilibrium`"
                )
        body = inputs.values.current(own)
        if body._has_grown:
            raise ValueError(
                f"{body!r} has grown or bent at rest, and its rest shape is no equilibrium then: find one with "
                "ms.equilibrium, and hand it over as `equilibrium`"
            )
    for k, muscle in enumerate(muscles_in(inputs.scene)):
        states = FibreStates(*_core.fibre_states(model, k, model.rest_state(), None))
        if np.abs(states.tensions).max() > _ROUND_OFF * inputs.values.current(muscle).strength:
            raise ValueError(
                f"{muscle!r} pulls at the rest shape, which is no equilibrium then: find one with ms.equilibrium, and hand "
                "it over as `equilibrium`; without activation its stiffness at rest counts"
            )


def _refuse_custom_forces(inputs: Inputs) -> None:
    """Raise ValueError if springs, or a CustomEnergy that is no load, have forces at the rest shape beyond
    round-off.
    """
    scene = inputs.scene
    own: dict[str, CustomEnergy | Springs] = {}
    for each in scene.loads:
        if isinstance(each, CustomEnergy) and not each.is_load:
            own[each.name] = each
        elif isinstance(each, Springs):
            own["springs"] = each
    if not own:
        return
    model, state, load_parameters = (
        scene._model,
        scene._model.rest_state(),
        scene._load_parameter_layout.zeros(),
    )
    forces = [np.abs(model.term_gradient(name, state, load_parameters)).max() for name in own]
    _, _, _, stiffness = model.hessian(state, load_parameters, reduced=False)
    size = max(scene._bodies.extent, np.abs(state).max())
    for each, force in zip(own.values(), forces, strict=True):
        if force > _ROUND_OFF * np.abs(stiffness).max() * size:
            raise ValueError(
                f"{each!r} pulls at the rest shape, which is no equilibrium then: find one with ms.equilibrium, and hand "
                "it over as `equilibrium`"
            )
