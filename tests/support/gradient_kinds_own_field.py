"""Kinds of scene in which shells act on each other with their own magnetic field, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

SHIFT = (4e-3, 3e-3, 0.012)  # [m] of the upper sheet: no edge lies above another


def own_field(moves: bool) -> Kind:
    """Build two sheets above each other, of both laws: oblique at rest, in a uniform field too, or tangential in motion."""
    rng = np.random.default_rng(11)
    meshes = [MESH, MESH.transformed(translation=SHIFT)]
    sheets = [
        ms.Shell(
            each,
            thickness=thickness,
            young_modulus=3e6,
            poisson_ratio=0.3,
            mass_density=1e3,
            magnetization_law=law,
        )
        for each, thickness, law in zip(meshes, (1e-3, 1.2e-3), ("stretches", "rotates"), strict=True)
    ]
    supports = [
        ms.Clamp(mesh.edges_at(x=mesh.rest_positions[:, 0].min()), body=sheet)
        for mesh, sheet in zip(meshes, sheets, strict=True)
    ]
    magnetization = rng.uniform(-1.0, 1.0, (2 * MESH.n_faces, 3)) * 4e4 + np.array([3e4, 0.0, 2e4])
    inputs = {"remanent_magnetization": magnetization}
    if moves:
        inputs["remanent_magnetization"] = magnetization * np.array([1.0, 1.0, 0.0])
        scene = ms.Scene(sheets, supports=supports, own_field=ms.OwnField())
        fixed = {"steps": 3, "integrator": ms.TRBDF2(), "progress": False, **EXACT}
        return Kind(scene, {"time_step": 2e-3, **inputs}, ms.simulate, fixed=fixed, step=1e-4, reach=REACH)
    scene = ms.Scene(sheets, supports=supports, own_field=ms.OwnField(), field=ms.UniformField())
    inputs["applied_flux_density"] = np.array([1e-4, -2e-4, 3e-4])
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)
