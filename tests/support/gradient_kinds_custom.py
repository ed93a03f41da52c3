"""Kinds of scene with energies that users write in torch, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

SOME = np.random.default_rng(41)  # of its own: kinds listed later must not change


def spring(x, stiffness, length):
    import torch

    return 0.5 * stiffness * (torch.sqrt((x[1] - x[0]).square().sum()) - length) ** 2


def film(x, tension, pull):
    """Return the area times a tension, and the work of a force on the barycenter, both of numbers shared or per face."""
    import torch

    area = 0.5 * torch.sqrt(torch.linalg.cross(x[1] - x[0], x[2] - x[0]).square().sum())
    return tension[0] * area + tension[1] * area**2 - (pull * x.mean(0)).sum()


def bound_sheets() -> tuple[ms.Shell, ms.Shell, list[ms.CustomEnergy]]:
    """Build two sheets, springs between them, and a film on faces of one of them."""
    options = {"young_modulus": 1e6, "poisson_ratio": 0.4, "mass_density": 1e3}
    above = MESH.transformed(translation=(0.0, 0.0, 0.02))
    sheet, other = (ms.Shell(each, thickness=1e-3, **options) for each in (MESH, above))
    ends = MESH.vertices_at(x=0.1)
    springs = ms.CustomEnergy(
        spring,
        of=np.stack([ends, ends[::-1] + MESH.n_vertices], axis=1),
        values={"stiffness": 0.5 * SOME.uniform(0.8, 1.2, len(ends)), "length": 0.02},
    )
    faces = MESH.faces[[1, 4, 7]]
    skin = ms.CustomEnergy(
        film,
        of=faces,
        values={"tension": SOME.uniform(0.5, 1.0, (3, 2)) * (0.1, 100.0), "pull": [[1e-3, -2e-3, 3e-3]]},
        body=other,
        is_load=True,
    )
    return sheet, other, [springs, skin]


def custom_energies_at_rest() -> Kind:
    sheet, other, loads = bound_sheets()
    supports = [
        ms.Clamp(MESH.edges_at(x=0.0), rotation=(0, 0.1, 0), body=sheet),
        ms.Clamp(other.mesh.edges_at(x=0.0), body=other),
    ]
    scene = ms.Scene([sheet, other], supports=supports, loads=loads, gravity=(0.2, 0.1, -9.81))
    factors = {"load_factor": 0.9, "support_factor": 0.8, "gravity_factor": 0.3}
    return Kind(scene, factors, fixed=EXACT, reach=REACH)


def custom_energies_in_motion() -> Kind:
    sheet, other, loads = bound_sheets()
    supports = [ms.Clamp(MESH.edges_at(x=0.0), body=sheet)]
    scene = ms.Scene([sheet, other], supports=supports, loads=loads, allow_rigid_motions=True)
    fixed = {**EXACT, "steps": 3, "integrator": ms.TRBDF2(), "progress": False}
    inputs = {"time_step": 2e-3, "load_factor": np.linspace(0.5, 1.0, 4)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-4, reach=REACH, in_time=3)
