"""The parts of the scenes of gradient_kinds.py."""

from functools import cache

import numpy as np
import pytest
from adjoint_scenes import MAGNETIZATION, MESH, N_V

import magshell as ms
from magshell import obstacles as ob

torch = pytest.importorskip("torch")

RNG = np.random.default_rng(17)
# To the round-off of the positions: what a larger residual leaves of them differs by the number of iterations, and
# differences over 1e-5 of a size multiply it.
EXACT = {"solver": ms.MixedNewton(tolerance=1e-15)}
STEPS = 4
FACTORS = {"load_factor": 0.9, "gravity_factor": 0.8, "field_factor": 1.1, "support_factor": 0.7}
# Sizes of values that may be zero: m, rad, m/s.
REACH = {
    "center": 1e-3,
    "rotation": 0.3,
    "displacement": 1e-3,
    "velocity": 0.1,
    "velocities": 0.1,
    "start": 1e-3,
}
VISCOUS = {
    "damping": RNG.uniform(1e-3, 2e-3, N_V),
    "stiffness_damping": 2e-3,
    "maxwell_modulus": np.array((0.5, 0.2)),
    "maxwell_time": np.array((4e-3, 1.5e-2)),
}
# Numbers of ms.Water. Their lower bound is zero, and differences need values away from it.
IN_WATER = {
    "drag_coefficient": 0.9,
    "thrust_coefficient": 0.7,
    "added_mass": 0.6,
    "normal_viscous_drag": 200.0,
    "tangential_viscous_drag": 80.0,
}
IN_TIME = {
    "applied_flux_density": np.array((1e-3, -2e-3, 3e-3)) * RNG.uniform(0.5, 1.5, (STEPS + 1, 3)),
    "load_factor": RNG.uniform(0, 1, STEPS),
    "field_factor": RNG.uniform(0.5, 1, STEPS + 1),
    "support_factor": np.linspace(0, 0.7, STEPS + 1),
    "gravity_factor": 0.8,
    "remanent_magnetization": MAGNETIZATION,
}
BEGIN = {
    "start": MESH.rest_positions + 1e-4 * RNG.standard_normal((N_V, 3)),
    "velocities": 0.1 * RNG.standard_normal((N_V, 3)),
    "time_step": 3e-3,
}
MIDDLE = np.array([0.07, 0.03, 0.0])
CURVE = np.linspace(-0.06, 0.06, 5)[:, None] * (0, 1, 0) + 4e-3 * np.linspace(-1, 1, 5)[:, None] ** 2 * (
    1,
    0,
    0,
)
GRID = np.linspace(-0.1, 0.1, 9)
UNDER = {  # every obstacle, its highest point at the middle of its own frame
    ob.Plane: lambda **place: ob.Plane((-0.02, 0.01, 1.0), **place),
    ob.Sphere: lambda **place: ob.Sphere(0.06, **_lowered(place, 0.06)),
    ob.Box: lambda **place: ob.Box((0.06, 0.09, 0.04), rounding=0.015, **_lowered(place, 0.02)),
    ob.Capsule: lambda **place: ob.Capsule(
        [[0.0, -0.03, 0.0], [0.01, 0.03, 0.0]], 0.04, **_lowered(place, 0.04)
    ),
    ob.Ellipsoid: lambda **place: ob.Ellipsoid((0.08, 0.07, 0.05), **_lowered(place, 0.05)),
    ob.Tube: lambda **place: ob.Tube(CURVE, 0.03, inside=False, **_lowered(place, 0.03)),
    ob.HeightField: lambda **place: ob.HeightField(
        GRID, GRID, 1e-3 * np.sin(40 * GRID)[:, None] * np.cos(30 * GRID), **place
    ),
    ob.MeshObstacle: lambda **place: ob.MeshObstacle(_ball(), resolution=16, **_lowered(place, 0.06)),
}


def _lowered(pose: dict, by: float) -> dict:
    return {**pose, "center": np.array(pose["center"]) - np.array([0, 0, by])}


@cache
def _ball():
    return ms.meshes.spherical_cap(0.06, 0.0, np.pi, cells=(24, 12))


def under(shape, height: float, **place):
    """Build an obstacle of this class, with its highest point at a height above the sheet's reference plane."""
    center = MIDDLE + np.array([0, 0, height])
    return UNDER[shape](**{"center": center, "rotation": (0.01, -0.02, 0.1), **place})
