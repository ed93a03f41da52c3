"""How far what acts on the bodies of a scene would strain them: the scale of a load, in orders of magnitude."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...model.scene.solve_inputs import Inputs

_STRETCH = 1e-3  # of all lengths
_OTHER_TERMS = frozenset(
    (
        "contact",
        "body contact",
        "couple",
        "joints",
        "loads",
        "gravity",
        "magnetic",
        "moments",
        "pressure",
        "volume",
        "wrenches",
    )
)


def strain_of_loads(inputs: Inputs) -> float:
    """Return the even strain at which the elastic energy 1/2 C e^2 balances the work W e of what acts at the rest shape,
    W / C: W = sum |f| |x - mean x| over the vertices. Zero where that says nothing, as of scenes with rigid parts.
    """
    scene = inputs.scene
    if scene.rigid_parts or not scene.bodies:
        return 0.0
    model, x = scene._model, scene.mesh.rest_positions
    arms = x - x.mean(axis=0)
    rest, nothing = model.rest_state(), scene._load_parameter_layout.zeros()
    with inputs.in_core():
        force = model.positions(model.gradient(rest, inputs.load_parameters))
        stretched = model.state(x + _STRETCH * arms, np.zeros(scene._bodies.n_rotations))
        energies = [_elastic_energy(model.term_energies(each, [], nothing)) for each in (stretched, rest)]
    stiffness = 2.0 * (energies[0] - energies[1]) / _STRETCH**2
    work = float((np.linalg.norm(force, axis=1) * np.linalg.norm(arms, axis=1)).sum())
    return work / stiffness if stiffness > 0.0 and np.isfinite(work) else 0.0


def _elastic_energy(energies: list[tuple[str, float]]) -> float:
    return sum(energy for name, energy in energies if name not in _OTHER_TERMS)
