"""Kinds of scene for test_every_gradient.py in which rigid bodies carry obstacles."""

import numpy as np
from adjoint_scenes import MESH, N_V
from gradient_kinds_bodies import CORNER
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms
from magshell import obstacles as ob

LAW = {"contact_stiffness": 50.0, "offset": 1e-4}
RUBS = {**LAW, "friction_coefficient": 0.4}
PLACE = {
    "center": 1e-3,
    "rotation": 0.3,
    "axis": 0.3,
    "origin": 1e-3,
    "velocity": 0.1,
    "angular_velocity": 3.0,
}


def _sheet(modulus=1e6):
    return ms.Shell(MESH, thickness=1e-3, young_modulus=modulus, poisson_ratio=0.4, mass_density=1e3)


def _arm(**others):
    """Build a link on a sprung hinge, and the ellipsoid that it carries below the sheet."""
    link = ms.Link(mass=4e-3, inertia=(1.2e-6, 2e-6, 1.5e-6), center=(0.08, 0.03, -0.02), **others)
    hinge = ms.Revolute(link, origin=(0.12, 0.02, -0.02), axis=(0.1, 1, 0.2), spring_stiffness=0.05)
    egg = ob.Attached(
        ob.Ellipsoid((0.02, 0.03, 0.01)), to=link, center=(0.078, 0.031, -0.0125), rotation=(0.1, -0.05, 0.3)
    )
    return ms.Skeleton([link], [hinge]), egg


def thrown_onto_attached(integrator, **contact) -> Kind:
    """Build a sheet that falls onto a ball, which flies and spins, and onto an ellipsoid on a hinged arm."""
    ball = ms.RigidBody(
        mass=5e-3,
        inertia=(1.8e-6, 2e-6, 2.2e-6),
        center=(0.034, 0.029, -0.034),
        velocity=(0.05, -0.02, 0.1),
        angular_velocity=(2.0, 3.0, -1.0),
    )
    round_ball = ob.Attached(ob.Sphere(0.03), to=ball, center=(0.035, 0.03, -0.032), rotation=(0.1, 0, 0))
    skeleton, egg = _arm()
    scene = ms.Scene(
        [_sheet(), ball, skeleton],
        contacts=[ms.Contact([round_ball, egg], **{**LAW, **contact})],
        gravity=(0, 0.3, -9.81),
        allow_rigid_motions=True,
    )
    rng = np.random.default_rng(41)
    inputs = {
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * rng.standard_normal((N_V, 3)),
        "time_step": 2e-3,
        "gravity_factor": 0.9,
    }
    fixed = {**EXACT, "steps": 6, "integrator": integrator, "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach={**REACH, **PLACE})


def resting_on_attached() -> Kind:
    """Build a clamped sheet that hangs onto an ellipsoid, which yields on its hinge."""
    skeleton, egg = _arm()
    scene = ms.Scene(
        [_sheet(2e7), skeleton],
        supports=[ms.Clamp(MESH.edges_at(x=0.0))],
        contacts=[ms.Contact(egg, **{**LAW, "face_samples": 1})],
        gravity=(0.1, 0.2, -2.0),
    )
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, step=5e-5, reach={**REACH, **PLACE})


def ball_on_a_sheet_at_rest() -> Kind:
    """Build a clamped sheet whose rigid corner carries a ball, which sags onto another sheet."""
    upper, below = _sheet(2e8), MESH.transformed(translation=(0.0, 0.0, -0.0635))
    lower = ms.Shell(below, thickness=1e-3, young_modulus=1e9, poisson_ratio=0.4, mass_density=1e3)
    corner = ms.RigidBody(CORNER, body=upper, mass=4e-3, inertia=1e-6)
    middle = MESH.rest_positions[CORNER].mean(axis=0)
    ball = ob.Attached(ob.Sphere(0.03), to=corner, center=np.add(middle, (1e-3, -5e-4, -0.0325)))
    scene = ms.Scene(
        [upper, lower, corner],
        supports=[ms.Clamp(MESH.edges_at(x=0.0), body=each) for each in (upper, lower)],
        contacts=[ms.Contact(ball, **{**LAW, "face_samples": 1}, body=lower)],
        gravity=(0.1, 0.2, -2.0),
    )
    reach = {**REACH, **PLACE, "rest_positions": 0.02}
    # Membranes are stiff and bending is soft, so that round-off of the forces moves equilibria by up to 3e-11 m.
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, step=4e-4, reach=reach)


def thrown_onto_a_moving_ellipsoid() -> Kind:
    egg = ob.Ellipsoid((0.06, 0.05, 0.03), center=(0.05, 0.03, -0.0315), rotation=(0.05, -0.02, 0.2))
    scene = ms.Scene(
        _sheet(), contacts=[ms.Contact(egg, **RUBS)], gravity=(0, 0.3, -9.81), allow_rigid_motions=True
    )
    rng = np.random.default_rng(43)
    inputs = {
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * rng.standard_normal((N_V, 3)),
        "time_step": 2e-3,
    }
    fixed = {**EXACT, "steps": 6, "integrator": ms.ImplicitEuler(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=REACH, in_time=6)


ATTACHED_MAKERS = {
    "onto attached obstacles": lambda: thrown_onto_attached(ms.ImplicitEuler()),
    "onto attached obstacles, rubbing, tr_bdf2": lambda: thrown_onto_attached(ms.TRBDF2(), **RUBS),
    "onto attached obstacles, rubbing, contact implicit": lambda: thrown_onto_attached(
        ms.TRBDF2(implicit_contact=True), **RUBS, face_samples=1
    ),
    "onto attached obstacles, rubbing late": lambda: thrown_onto_attached(
        ms.TRBDF2(), **RUBS, lagged_friction=True
    ),
    "at rest on an attached obstacle": resting_on_attached,
    "at rest under a ball on a sheet": ball_on_a_sheet_at_rest,
    "onto an Ellipsoid that moves": thrown_onto_a_moving_ellipsoid,
}
