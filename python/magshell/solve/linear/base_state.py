"""Linear theory about an equilibrium: its inputs, and the stiffness there."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...model.scene.scene import Scene
from ...model.scene.solve_inputs import Inputs, Leaf, plain_inputs
from ..adjoint.buckling import AFTER, BEFORE
from ..adjoint.residual import Residual
from ..statics.equilibrium import Equilibrium
from .stiffness import Stiffness


def idle_inputs(
    scene: Scene,
    replaced: dict[Any, Any],
    flux_density: Any = None,
    differentiable: bool = False,
    **factors: Any,
) -> Inputs:
    """Return inputs without loads and field unless they are given; shells and skins without magnetization get zero."""
    if scene.is_magnetic:
        nothing = {"remanent_magnetization": np.zeros(3)}
        magnetic = (*scene._bodies.shells, *scene._bodies.skins)
        replaced = {**replaced, **{each: {**nothing, **replaced.get(each, {})} for each in magnetic}}
    if flux_density is None and scene.has_uniform_field and not factors:
        flux_density = np.zeros(3)
    return Inputs(scene, None, flux_density, replaced=replaced, differentiable=differentiable, **factors)


def inputs_about(
    scene: Scene,
    equilibrium: Equilibrium,
    *,
    remanent_magnetization: Any = None,
    applied_flux_density: Any = None,
    values: dict[Any, Any] | None = None,
    differentiable: bool = False,
    **factors: Any,
) -> Inputs:
    """Return inputs with the magnetization and the values of an equilibrium, and with the load parameters given here.

    Raises ValueError if the equilibrium is of another scene, or if values are given that it has itself.
    """
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a Scene, got {type(scene).__name__}")
    if not isinstance(equilibrium, Equilibrium):
        raise ValueError(f"equilibrium must be an Equilibrium, got {type(equilibrium).__name__}")
    if equilibrium.scene is not scene:
        raise ValueError("the equilibrium is of another scene")
    own = (
        ("values are those", "them", values),
        ("remanent_magnetization is that", "it", remanent_magnetization),
    )
    for what, it, given in own:
        if given is not None:
            raise ValueError(
                f"{what} of the equilibrium: give {it} to ms.equilibrium, or give no equilibrium"
            )
    inputs = idle_inputs(scene, {}, applied_flux_density, differentiable, **factors)
    return inputs.with_values(equilibrium._values)


def linear_inputs(scene: Scene, equilibrium: Equilibrium | None, arguments: dict[str, Any]) -> Inputs:
    """Return the inputs of a linear solve, at rest or about an equilibrium, from its keywords.

    Raises ValueError if they do not fit the scene or the equilibrium.
    """
    if equilibrium is None:
        return plain_inputs(scene, differentiable=True, **arguments)
    inputs = inputs_about(scene, equilibrium, differentiable=True, **arguments)
    check_change(equilibrium, inputs)
    return inputs


def leaves_of(inputs: Inputs, equilibrium: Equilibrium | None) -> list[tuple[Leaf, int]]:
    """Return the leaves of a linear solve, each with the load parameters to which it may belong, BEFORE or AFTER."""
    own = [] if equilibrium is None or equilibrium._inputs is None else equilibrium._inputs.leaves
    return [*((leaf, BEFORE) for leaf in own), *((leaf, AFTER) for leaf in inputs.leaves)]


def residual_of(inputs: Inputs, equilibrium: Equilibrium | None) -> Residual:
    """Return the gradient of the energy at the rest shape without loads, or at an equilibrium with its own inputs."""
    if equilibrium is None:
        return Residual(
            inputs, inputs.scene._model.rest_state(), [], inputs.scene._load_parameter_layout.zeros()
        )
    about = inputs if equilibrium._inputs is None else equilibrium._inputs
    return Residual(about, equilibrium._state, equilibrium._angle_branches, equilibrium._load_parameters)


def set_state(equilibrium: Equilibrium) -> None:
    """Set the full turns of angles in the core to those of an equilibrium, from which later evaluations continue.

    The state itself determines angles up to full turns only.
    """
    model = equilibrium.scene._model
    model.held_forces(equilibrium._state, equilibrium._angle_branches, equilibrium._load_parameters)


class StiffnessAbout(Stiffness):
    """The Hessian K at an equilibrium with its own load parameters.

    Raises ValueError if the equilibrium turns out not to be stable when K is factorized.
    """

    def __init__(self, equilibrium: Equilibrium):
        self._equilibrium = equilibrium
        set_state(equilibrium)
        super().__init__(
            equilibrium.scene, equilibrium._state, equilibrium._load_parameters, "at the equilibrium"
        )

    def response(self, inputs: Inputs) -> np.ndarray:
        """Return du of all degrees of freedom for load parameters that change from c to c1: K du = g(c) - g(c1) - K dm."""
        set_state(self._equilibrium)  # in the model of this thread
        model, layout = self._model, inputs.scene._load_parameter_layout
        further = inputs.load_parameters - self.load_parameters
        moved = model.prescribed_rate(self.load_parameters) * layout.of(further, "scene", "support_factor")
        if (
            inputs.scene.has_susceptible_shells
        ):  # forces are quadratic in the field: a central difference is exact
            ahead, behind = (
                model.gradient(self.state, self.load_parameters + way * further) for way in (1.0, -1.0)
            )
            return self.answer(0.5 * (behind - ahead), moved)
        forces = self.gradient - model.gradient(self.state, inputs.load_parameters)
        return self.answer(forces, moved)


def check_change(equilibrium: Equilibrium, inputs: Inputs) -> None:
    """Raise ValueError if no load parameter changes, or if the equilibrium is not stable."""
    if not equilibrium.stable:
        raise ValueError(
            "the equilibrium is not stable, so that nothing stays near it: linear theory needs one that is"
        )
    if np.array_equal(inputs.load_parameters, equilibrium._load_parameters):
        raise ValueError(
            "the load parameters are those of the equilibrium, so that nothing changes: give the load_factor, "
            "applied_flux_density, ... towards which they go, as to ms.follow_path"
        )
