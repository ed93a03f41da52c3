"""Kinds of scene with shells that an applied field magnetizes, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms


def susceptible_shells(moves: bool) -> Kind:
    """Build a sheet near a magnet, whose faces sample it finely, and one far from it that is magnetized at rest too."""
    rng = np.random.default_rng(33)
    meshes = [MESH, MESH.transformed(translation=(0.0, 0.0, 0.08))]
    sheets = [
        ms.Shell(
            mesh,
            thickness=2e-3,
            young_modulus=1e7 if moves else 1e8,  # so stiff at rest that no magnet pulls it in
            poisson_ratio=0.4,
            mass_density=1e3,
            susceptibility=rng.uniform(0.5, 2.0, mesh.n_faces),
            **remanent,
        )
        for mesh, remanent in zip(
            meshes,
            ({}, {"remanent_magnetization": rng.uniform(-1.0, 1.0, (MESH.n_faces, 3)) * 3e4}),
            strict=True,
        )
    ]
    magnet = ms.CuboidMagnet(
        (0.03, 0.02, 0.01),
        center=(0.07, 0.03, -0.02),
        rotation=(0.1, 0.05, 0.3),
        remanent_magnetization=(2e4, -4e4, 1.5e5),
    )
    dipole = ms.Dipoles([[0.12, 0.01, 0.05]], [[0.5, 0.1, -0.3]])
    scene = ms.Scene(
        sheets,
        supports=[
            ms.Clamp(mesh.edges_at(x=0.0), body=sheet) for mesh, sheet in zip(meshes, sheets, strict=True)
        ],
        field=[ms.UniformField(), magnet, dipole],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {"applied_flux_density": np.array([1e-2, -2e-2, 3e-2]), "field_factor": 0.8}
    if not moves:
        return Kind(scene, inputs, fixed=EXACT, reach=REACH)
    fixed = {**EXACT, "steps": 3, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, {**inputs, "time_step": 1e-3}, ms.simulate, fixed=fixed, step=1e-3, reach=REACH)
