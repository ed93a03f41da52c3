"""The integrator of a motion by default, and which integrators can treat the contact of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..._input.tensors import detached
from ...model.contact.obstacles import Attached
from ..options import TRBDF2, ImplicitEuler, Integrator

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs


def default_integrator(inputs: Inputs) -> Integrator:
    """Return the integrator of a motion for which none is given.

    It is TRBDF2(). If the scene has contacts, contact is implicit in it; with added mass of water too, which contact forces
    would have to accelerate as well, it is ImplicitEuler().
    """
    if not inputs.scene.contacts:
        return TRBDF2()
    return ImplicitEuler() if _added_mass(inputs) > 0.0 else TRBDF2(implicit_contact=True)


def integrator_of_actions() -> Integrator:
    """Return the integrator of an environment with contacts for which none is given.

    Each differentiable action is a motion that starts from positions and velocities alone. TRBDF2 computes the accelerations
    there again and takes another first step than in a motion that goes on; ImplicitEuler has the same bits.
    """
    return ImplicitEuler()


def check_contact_method(inputs: Inputs, integrator: Integrator) -> None:
    """Raise ValueError if an integrator cannot treat the contact of a motion as it is asked to."""
    scene = inputs.scene
    attached = [each for each in scene.obstacles if isinstance(each, Attached)]
    if attached and getattr(integrator, "_projective", None) is not None:
        raise ValueError(
            f"ms.ProjectiveDynamics does not take an obstacle that a body carries: {attached[0]!r:.80}"
        )
    if not getattr(integrator, "implicit_contact", False) or not scene.contacts:
        return
    added_mass = _added_mass(inputs)
    if added_mass > 0.0:
        raise ValueError(
            "TRBDF2(implicit_contact=True) needs water without added mass, which contact forces would accelerate as "
            f"well; the water has added_mass = {added_mass:g} kg/m2. Take TRBDF2() or ImplicitEuler()"
        )


def _added_mass(inputs: Inputs) -> float:
    water = inputs.scene.water
    return 0.0 if water is None else float(detached(inputs.values.current(water).added_mass))
