"""Projective Dynamics with muscles, cells, cavities, tendons, and joint torques: Newton's solutions in few
iterations.
"""

import numpy as np
import pytest
from muscle_curves import FORCE_LENGTH
from muscle_rates import FORCE_VELOCITY
from projective_bars import MATERIALS, MODULI, SIZE, assert_same, bar, both, clamped

import magshell as ms

EVERY = {"stretch": {"stiffness": 1e5}, "stress": {"peak_stress": 4e4}}
EVERY["hill"] = {
    "peak_stress": 4e4,
    "force_length": FORCE_LENGTH,
    "force_velocity": FORCE_VELOCITY,
    "shortening_rate": 5.0,
}
SKEW = (1.0, 0.3, 0.0)


def held(solid, *actuators, **options):
    return ms.Scene(solid, supports=[clamped(solid)], actuators=actuators, gravity=(0, 2.0, -9.81), **options)


def muscled(law, element="linear"):
    solid = bar(MATERIALS["Projective"], element, cells=(6, 2, 2) if element == "linear" else (3, 1, 1))
    muscle = ms.Muscle(solid, SKEW, **EVERY[law])
    return held(solid, muscle), {muscle: {"activation": np.linspace(0.1, 0.6, 5)}}


def celled(grouped, order=1):
    solid = bar(
        MATERIALS["Projective"],
        "linear" if order == 1 else "quadratic",
        cells=(6, 2, 2) if order == 1 else (3, 1, 1),
    )
    middle = solid.mesh.tetrahedron_barycenters[:, 0] > 0.5 * SIZE[0]
    groups = [np.flatnonzero(middle), np.flatnonzero(~middle)] if grouped else None
    cells = ms.PneumaticCells(solid, groups, stiffness=2e5, volume_ratio=1.0)
    count = cells.count
    return held(solid, cells), {
        cells: {"volume_ratio": np.tile(np.linspace(1.0, 1.2, 5)[:, None], (1, count))}
    }


def hollow(**inside):
    mesh = ms.meshes.tube(0.004, 0.008, 0.02, cells=(2, 12, 4), order=1)
    solid = ms.Solid(mesh, material=MATERIALS["Projective"], mass_density=1e3, element="linear")
    rest = mesh.rest_positions
    inner = np.flatnonzero((np.hypot(*rest[:, :2].T) < 0.0041)[mesh.faces].all(axis=1))
    cavity = ms.Cavity(solid, inner, close_rims=True, **inside)
    pin = ms.Pin(np.flatnonzero(rest[:, 2] < 1e-9))
    scene = ms.Scene(solid, supports=[pin], actuators=[cavity], gravity=(0, 2.0, -9.81))
    return scene, cavity


def blown(law):
    volume = np.pi * 0.004**2 * 0.02
    inside = {
        "pressure": {"pressure": 2e3},
        "gas": {"gas_pressure": 1.04e5},
        "liquid": {"volume": 1.1 * volume, "bulk_modulus": 1e6},
    }[law]
    return hollow(**inside)[0], {}


def strung(sliding):
    solid = bar(MATERIALS["Projective"])
    top = [(x, 0.005, 0.01) for x in np.linspace(0.0, SIZE[0], 4)]
    tendon = ms.Tendon(top, solid, sliding=sliding, stiffness=50.0, tension=1e-3)
    return held(solid, tendon), {tendon: {"rest_length": np.linspace(1.0, 0.9, 5) * SIZE[0]}}


SCENES = {
    **{f"muscle {law}": lambda law=law: muscled(law) for law in EVERY},
    "quadratic muscle": lambda: muscled("stretch", "quadratic"),
    "cells": lambda: celled(False),
    "quadratic cells": lambda: celled(False, 2),
    "groups of cells": lambda: celled(True),
    **{f"cavity {law}": lambda law=law: blown(law) for law in ("pressure", "gas", "liquid")},
    "tendon": lambda: strung(True),
    "tendon fastened": lambda: strung(False),
}


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", SCENES)
def test_a_converged_step_is_newtons(name):
    scene, values = SCENES[name]()
    assert_same(*both(scene, values=values))


JOINTS = {
    "damper": {"damping": 1e-3},
    "strong damper": {"damping": 1e-2},
    "motor": {"motor_angle": 0.1},
    "spring and limits": {
        "spring_stiffness": 1e-2,
        "upper_limit": 0.05,
        "limit_stiffness": 1.0,
        "limit_smoothing": 0.01,
    },
    "servo": {"target_angle": 0.3, "servo_stiffness": 1e-2, "torque_limit": 1e-3},
}


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("name", JOINTS)
def test_joint_torques_equal_those_of_newton(name):
    solid = bar(MATERIALS["Corotated"], cells=(8, 2, 2))
    x = solid.mesh.rest_positions[:, 0] / SIZE[0]
    bones = [
        ms.Link(vertices=np.flatnonzero((x > a) & (x < b)), body=solid) for a, b in ((0.1, 0.4), (0.6, 0.9))
    ]
    elbow = ms.Revolute(
        bones[1], bones[0], origin=(0.5 * SIZE[0], 0.005, 0.005), axis=(0, 1, 0), **JOINTS[name]
    )
    scene = ms.Scene([solid, ms.Skeleton(bones, [ms.Fixed(bones[0]), elbow])], gravity=(0, 8.0, -40.0))
    values = {elbow: {"motor_angle": lambda t: 0.1 + 2.0 * t}} if name == "motor" else {}
    assert_same(*both(scene, values=values, steps=6))


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
@pytest.mark.parametrize("law", ["stiffness", "peak_stress"])
def test_strong_muscles_are_in_the_matrix(law):
    """Limit the iterations to 68 and 31 a step; without the muscles' part in the matrix they were 124 and 69."""
    solid = bar(MATERIALS["Projective"])
    muscle = ms.Muscle(solid, SKEW, **{law: 50 * MODULI["young_modulus"]})
    move = ms.simulate(
        held(solid, muscle),
        steps=4,
        time_step=5e-3,
        values={muscle: {"activation": np.linspace(0.1, 0.6, 5)}},
        integrator=ms.ProjectiveDynamics(tolerance=1e-6),
        progress=False,
    )
    assert move.iterations < 4 * {"stiffness": 90, "peak_stress": 50}[law]
    assert move.factorizations == 1
