"""Forces between the parts of a scene cancel, with their torques, in every state; responses are reciprocal."""

import warnings
from functools import cache

import numpy as np
import pytest
from framed_scenes import EXTENT, PAIRS, build, names

import magshell as ms
from magshell import _core

# Terms between parts of a scene; others act from the ground, a field or an obstacle.
INTERNAL = (
    "membrane",
    "bending",
    "solid",
    "creases",
    "muscle",
    "own field",
    "body contact",
    "volume",
    "tendons",
)


@cache
def moved(name: str) -> ms.Trajectory:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return build(name).simulate(ms.TRBDF2())


@pytest.mark.parametrize("name", [*names(), *PAIRS])
def test_internal_forces_and_torques_cancel(name):
    move = moved(name)
    scene, model = move.scene, move.scene._model
    # Internal forces depend on no load parameter but the factor of actuators.
    layout = scene._load_parameter_layout
    loaded = layout.packed(
        {("scene", name): 1.0 for name in ("load_factor", "own_field_factor") if ("scene", name) in layout},
        layout.zeros(),
    )
    with move._conditions.inputs.in_core():
        gradients = _core.term_gradients(model, move.end.state, move.end.angle_branches, loaded)
        terms = [kind for kind, _, _ in _core.kinds_of_terms(model)]
    n_points = scene._bodies.n_points
    positions = move.end.state[: 3 * n_points].reshape(-1, 3)
    for term, gradient in zip(terms, gradients, strict=True):
        if term not in INTERNAL:
            continue
        forces = gradient[: 3 * n_points].reshape(-1, 3)
        size = np.abs(forces).sum()
        assert np.abs(forces.sum(axis=0)).max() <= 1e-11 * size
        directions = gradient[3 * n_points :][: 3 * len(scene._constraints.directions)].reshape(-1, 3)
        of_directions = move.end.state[3 * n_points :][: directions.size].reshape(-1, 3)
        torque = np.cross(positions, forces).sum(axis=0) + np.cross(of_directions, directions).sum(axis=0)
        assert np.abs(torque).max() <= 1e-11 * size * EXTENT + 1e-11 * np.abs(directions).sum()


RECIPROCAL = ("hanging", "hinged", "loaded", "solid", "actuated", "hanging + actuated")


@pytest.mark.parametrize("name", RECIPROCAL)
def test_linear_responses_are_reciprocal(name):
    made = build(name)
    body, positioned = made.bodies[-1]
    x = positioned.own.rest_positions
    at = [np.argmax(x @ (1.0, 0.3, 0.0)), np.argmax(x @ (1.0, -0.3, 0.1))]
    pulls = [ms.PointLoad([vertex], (0.0, 0.0, 0.0), body=body) for vertex in at]
    made.parts["loads"] = pulls  # nothing else pulls
    made.parts["actuators"] = []
    made.options.pop("gravity", None)
    keywords = {"applied_flux_density": (0.0, 0.0, 0.0)} if made.parts["field"] else {}
    scene = made.scene()
    forces = 1e-3 * np.array([(0.3, -0.5, 1.0), (-0.2, 0.7, 0.4)])
    answers = [
        ms.linear_response(
            scene, support_factor=0.0, values={pull: {"force": force}}, **keywords
        ).displacements[-len(x) :]
        for pull, force in zip(pulls, forces, strict=True)
    ]
    there, back = answers[0][at[1]] @ forces[1], answers[1][at[0]] @ forces[0]
    assert abs(there) > 1e-12
    assert there == pytest.approx(back, rel=1e-9)
