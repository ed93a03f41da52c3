"""Kinds of scene for test_every_gradient.py in which bodies touch each other, or themselves."""

import numpy as np
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

MESH = ms.meshes.rectangle(0.1, 0.06, cells=(2, 2), diagonals="alternating")
ABOVE = MESH.transformed(translation=(0.013, 0.007, 1.15e-3))
RUBS = {"friction_coefficient": 0.3, "static_friction_coefficient": 0.4, "sticking_speed": 5e-3}

_REACH = {**REACH, "rest_positions": 0.02}  # a fifth of the sheets: pairs come near within larger steps


def _two_sheets(modulus, **contact):
    lower = ms.Shell(MESH, thickness=1e-3, young_modulus=2 * modulus, poisson_ratio=0.4, mass_density=300.0)
    upper = ms.Shell(ABOVE, thickness=1e-3, young_modulus=modulus, poisson_ratio=0.3, mass_density=900.0)
    touch = ms.Contact(lower, upper, **{"contact_stiffness": 1e5, "activation_distance": 4e-4, **contact})
    return lower, upper, touch


def sheets_at_rest_on_each_other(**contact) -> Kind:
    """Build two sheets in contact, clamped at opposite sides, the upper one softer and heavier."""
    lower, upper, touch = _two_sheets(2e8, **contact)
    scene = ms.Scene(
        [lower, upper],
        supports=[
            ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0, 0.02, 0), body=lower),
            ms.Clamp(ABOVE.edges_at(x=0.113), body=upper),
        ],
        contacts=[touch],
        gravity=(0.2, 0.1, -9.81),
    )
    return Kind(scene, {"gravity_factor": 0.9, "support_factor": 0.8}, fixed=EXACT, step=5e-5, reach=_REACH)


def sheets_rubbing(integrator, step=1e-6, **contact) -> Kind:
    """Build a motion of the upper sheet thrown onto the lower one, which is held at a side."""
    lower, upper, touch = _two_sheets(5e6, **{**RUBS, **contact})
    scene = ms.Scene(
        [lower, upper],
        supports=[
            ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0, 0.02, 0), body=lower)
        ],
        contacts=[touch],
        gravity=(0.2, 0.1, -9.81),
        allow_rigid_motions=True,
    )
    velocities = np.zeros((scene.mesh.n_vertices, 3))
    velocities[MESH.n_vertices :] = (0.1, 0.05, -0.15)
    inputs = {"velocities": velocities, "time_step": 1e-3, "support_factor": np.linspace(0, 0.7, 6)}
    fixed = {**EXACT, "steps": 6, "integrator": integrator, "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=step, reach=_REACH)


FLAT = ms.meshes.rectangle(0.12, 0.03, cells=(8, 1))


def _hairpin() -> ms.TriangleMesh:
    """Build a strip: straight, half a circle, straight back and down."""
    s, across = FLAT.rest_positions[:, 0], FLAT.rest_positions[:, 1]
    radius, straight = 4e-3, 0.04
    angle = np.clip((s - straight) / radius, 0.0, np.pi)
    back = np.maximum(s - straight - np.pi * radius, 0.0)
    x = np.minimum(s, straight) + radius * np.sin(angle) - back
    z = radius * (1.0 - np.cos(angle)) - 0.05 * back
    return ms.TriangleMesh(np.stack([x, across + 0.08 * back, z], axis=1), FLAT.faces)


def onto_itself(**contact) -> tuple[ms.Scene, dict]:
    """Build a strip that comes back over itself, pressed down."""
    mesh = _hairpin()
    strip = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.3, mass_density=1e3)
    touch = ms.SelfContact(strip, **{"contact_stiffness": 1e5, "activation_distance": 4e-4, **contact})
    load = ms.PointLoad(FLAT.vertices_at(x=0.12), force=(0.0, 1e-4, -2e-2))
    clamp = ms.Clamp(FLAT.edges_at(x=0.0))
    return ms.Scene(strip, supports=[clamp], loads=[load], contacts=[touch]), {"load_factor": 0.9}


def folded_at_rest() -> Kind:
    scene, inputs = onto_itself()
    return Kind(scene, inputs, fixed=EXACT, step=1e-5, reach=REACH)


def folded_and_rubbing() -> Kind:
    scene, inputs = onto_itself(law="penalty", contact_stiffness=1e4, **{**RUBS, "sticking_speed": 0.1})
    fixed = {**EXACT, "steps": 8, "integrator": ms.ImplicitEuler(), "progress": False}
    inputs |= {"time_step": 4e-3, "velocities": (0.0, 0.1, 0.0)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-6, reach=REACH)


CONTACT_MAKERS = {
    "sheets at rest on each other": sheets_at_rest_on_each_other,
    "sheets at rest on each other, penalty": lambda: sheets_at_rest_on_each_other(law="penalty"),
    "sheets rubbing": lambda: sheets_rubbing(ms.ImplicitEuler()),
    "sheets rubbing late": lambda: sheets_rubbing(ms.TRBDF2(), lagged_friction=True),
    "a sheet on itself": folded_at_rest,
    "a sheet on itself, rubbing": folded_and_rubbing,
}
