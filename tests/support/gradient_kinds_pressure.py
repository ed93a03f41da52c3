"""Kinds of scene under follower pressures, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH, RNG, under

import magshell as ms
from magshell import obstacles as ob


def _solid(element: str) -> tuple[ms.Solid, list]:
    """Build a solid held at one end, with a pressure all around and one on each face at the other end."""
    body = ms.Solid(
        ms.meshes.box((0.1, 0.04, 0.04), cells=(2, 1, 1)),
        material=ms.NeoHookean("isochoric", young_modulus=1e5, poisson_ratio=0.45),
        mass_density=1e3,
        element=element,
    )
    end = np.flatnonzero(body.mesh.face_barycenters[:, 0] > 0.06)[::3]
    return body, [ms.Pressure(400.0), ms.Pressure(RNG.uniform(-1e3, 2e3, len(end)), faces=end)]


def pressed_solid(moves: bool) -> Kind:
    """Build a solid under pressure.

    As an equilibrium its support rotates, too; in motion the pressures change, and it is in contact with friction.
    """
    body, loads = _solid("linear" if moves else "quadratic")
    left = np.flatnonzero(body.mesh.rest_positions[:, 0] < 1e-9)
    place = {} if moves else {"displacement": (1e-3, 0, 2e-4), "rotation": (0.0, 0.1, 0.05)}
    supports = [ms.Pin(left, **place)]
    if not moves:
        scene = ms.Scene(body, supports=supports, loads=loads, gravity=(0.2, 0.1, -9.81))
        factors = {"load_factor": 0.9, "support_factor": 0.8, "gravity_factor": 1.1}
        return Kind(scene, factors, fixed=EXACT, reach=REACH)
    floor = ms.Contact(
        ob.Plane((-0.02, 0.01, 1.0), center=(0.05, 0, body.mesh.rest_positions[:, 2].min() - 4e-4)),
        contact_stiffness=5.0,
        offset=3e-4,
        smoothing=1e-4,
        friction_coefficient=0.3,
    )
    scene = ms.Scene(body, supports=supports, loads=loads, contacts=[floor])
    fixed = {"steps": 3, "integrator": ms.TRBDF2(), "progress": False, **EXACT}
    inputs = {"time_step": 2e-3, "load_factor": np.linspace(0.5, 1.0, 4)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=REACH, in_time=3)


def pressed_sheet(moves: bool) -> Kind:
    """Build a flap with a different pressure on some faces: a load without a potential."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    supports = [ms.Clamp(MESH.edges_at(x=0.0), displacement=(1e-4, 0, 2e-4), rotation=(0.0, 0.1, 0.02))]
    loads = [ms.Pressure(RNG.uniform(-0.8, -0.4, 3), faces=[1, 4, 7]), ms.Pressure(-0.3)]
    if not moves:
        scene = ms.Scene(sheet, supports=supports, loads=loads)
        return Kind(scene, {"load_factor": 0.9, "support_factor": 0.8}, fixed=EXACT, reach=REACH)
    touching = [ms.Contact(under(ob.Plane, -2e-3), contact_stiffness=50.0, offset=1e-4)]
    scene = ms.Scene(sheet, supports=supports, loads=loads, contacts=touching)
    fixed = {**EXACT, "steps": 3, "integrator": ms.SDIRK2(), "progress": False}
    inputs = {"time_step": 2e-3, "support_factor": np.linspace(0, 0.7, 4)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=REACH)
