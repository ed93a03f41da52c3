"""The integrator of a motion by default, and which integrators can treat the contact of a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...model.contact.obstacles import Attached
from ..options import TRBDF2, ImplicitEuler, Integrator

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs


def default_integrator(inputs: Inputs) -> Integrator:
    """Return the integrator of a motion for which none is given.

    It is TRBDF2(); if the scene has contacts, contact is implicit in it.
    """
    return TRBDF2(implicit_contact=True) if inputs.scene.contacts else TRBDF2()


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
