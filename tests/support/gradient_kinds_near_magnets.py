"""Kinds of scene whose faces sample the field of near magnets finely, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms


def near_magnets(moves: bool) -> Kind:
    """Build two sheets and a solid with a skin, each nearer to a magnet than its faces are long."""
    rng = np.random.default_rng(21)
    up = np.array([0.0, 0.0, 0.05])
    meshes = [MESH, MESH.transformed(translation=up)]
    sheets = [
        ms.Shell(
            mesh,
            thickness=2e-3,
            young_modulus=1e7 if moves else 1e8,  # so stiff at rest that its weight leaves it where it is
            poisson_ratio=0.4,
            mass_density=1e3,
            remanent_magnetization=rng.uniform(-1.0, 1.0, (mesh.n_faces, 3)) * 3e4,
            magnetization_law=law,
        )
        for mesh, law in zip(meshes, ("stretches", "rotates"), strict=True)
    ]
    box = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1)).transformed(translation=(0.0, 0.1, 0.0))
    skin = ms.Skin(
        thickness=2e-3,
        mass_density=800.0,
        faces=box.faces_at(z=0.0),
        remanent_magnetization=(2e4, 1e4, 3e4),
        magnetization_law="rotates",
    )
    rubber = ms.StableNeoHookean(young_modulus=2e6, poisson_ratio=0.3)
    solid = ms.Solid(box, material=rubber, mass_density=1e3, element="linear", skin=skin)
    strong = {"remanent_magnetization": (2e4, -4e4, 2e5)}
    below = ms.CuboidMagnet(
        (0.03, 0.02, 0.01), center=(0.07, 0.03, -0.02), rotation=(0.1, 0.05, 0.3), **strong
    )
    between = ms.CylinderMagnet(0.01, 0.01, center=(0.07, 0.02, 0.028), rotation=(0.05, -0.1, 0.0), **strong)
    under_box = ms.PlacedField(
        ms.Dipoles([[0.0, 0.0, -0.025]], [[0.03, 0.02, 0.1]]), center=(0.04, 0.11, 0.0)
    )
    supports = [
        *(ms.Clamp(mesh.edges_at(x=0.0), body=sheet) for mesh, sheet in zip(meshes, sheets, strict=True)),
        ms.Pin(box.vertices_at(x=0.0), body=solid),
    ]
    scene = ms.Scene(
        [*sheets, solid],
        supports=supports,
        field=[ms.UniformField(), below, between, under_box],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {"applied_flux_density": np.array([1e-3, -2e-3, 2e-3]), "field_factor": 0.8}
    if not moves:
        return Kind(scene, inputs, fixed=EXACT, reach=REACH)
    fixed = {**EXACT, "steps": 3, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, {**inputs, "time_step": 1e-3}, ms.simulate, fixed=fixed, step=1e-3, reach=REACH)
