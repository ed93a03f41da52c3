"""Kinds of scene with muscles, for gradient_kinds.py."""

import numpy as np
from gradient_scenes import Kind
from gradient_world import EXACT, REACH, RNG

import magshell as ms

_PLACES = np.linspace(0.4, 1.6, 9)
_LENGTH = np.stack([_PLACES, np.exp(-(((_PLACES - 1.05) / 0.4) ** 2))], axis=1)
_PASSIVE = np.stack([_PLACES, 0.5 * np.clip(_PLACES - 0.9, 0, None) ** 2], axis=1)
_RATES = np.linspace(-1, 1, 9)
_VELOCITY = np.stack([_RATES, 1.0 + 0.4 * np.tanh(2 * _RATES)], axis=1)


def _body(element: str):
    return ms.Solid(
        ms.meshes.box((0.1, 0.04, 0.04), cells=(3, 1, 1)),
        material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4),
        mass_density=1e3,
        element=element,
    )


def _muscles(body, moves: bool) -> list[ms.Muscle]:
    """Build muscles with a target stretch, in segments along a curved line, an active stress, and Hill's law.

    They have weights and directions of their own.
    """
    line = [(0.0, 0.02, 0.04), (0.04, 0.015, 0.035), (0.1, 0.02, 0.04)]
    curved = ms.fibres_along(line, body, reach=0.02)
    target = ms.Muscle(body, curved, stiffness=8e4, segments=3, activation=(0.1, -0.05, 0.2))
    some = np.arange(2, 9)
    fibres = np.array([1.0, 0.3, -0.2]) + 0.3 * RNG.standard_normal((len(some), 3))
    weights = RNG.uniform(0.5, 1.5, len(some))
    active = ms.Muscle(body, fibres, elements=some, weights=weights, peak_stress=3e4, activation=0.4)
    curves = {"force_length": _LENGTH, "passive": _PASSIVE}
    if moves:
        curves |= {"force_velocity": _VELOCITY, "shortening_rate": 8.0}
    hill = ms.Muscle(body, (1.0, -0.2, 0.1), peak_stress=4e4, activation=0.5, **curves)
    return [target, active, hill]


def muscles_at_rest() -> Kind:
    body = _body("quadratic")
    held = ms.Pin(body.mesh.vertices_at(x=0.0))
    load = ms.PointLoad(body.mesh.vertices_at(x=0.1), force=(0.05, 0.02, -0.1))
    scene = ms.Scene(
        body, supports=[held], loads=[load], actuators=_muscles(body, False), gravity=(0.2, 0.1, -9.81)
    )
    return Kind(scene, {"load_factor": 0.9, "gravity_factor": 1.1}, fixed=EXACT, reach=REACH)


def muscles_in_motion(integrator, in_time: int = 0, element: str = "linear") -> Kind:
    """Build a motion that is fast enough for the force-velocity curve to matter."""
    body = _body(element)
    scene = ms.Scene(
        body,
        supports=[ms.Pin(body.mesh.vertices_at(x=0.0))],
        actuators=_muscles(body, True),
        gravity=(0.2, 0.1, -9.81),
    )
    fixed = {**EXACT, "steps": 3, "integrator": integrator, "progress": False}
    x = body.rest_positions
    inputs = {
        "time_step": 2e-3,
        "velocities": (x[:, :1] / 0.1) * (0.3, 0.2, -0.4) * RNG.uniform(0.8, 1.2, (len(x), 1)),
    }
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=REACH, in_time=in_time)
