"""Kinds of scene whose magnetization turns with the bodies and does not stretch, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import DIPOLES, MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms


def rotating_magnetization(moves: bool) -> Kind:
    """Build a sheet, a curved sheet of six-node elements, and a magnetized solid with a skin, all of the law "rotates"."""
    rng = np.random.default_rng(5)
    law = {"magnetization_law": "rotates"}

    def magnetization(count: int) -> np.ndarray:
        return rng.uniform(-1.0, 1.0, (count, 3)) * 2e4 + np.array([2e4, 0.0, 1e4])

    sheet = ms.Shell(
        MESH,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        remanent_magnetization=magnetization(MESH.n_faces),
        **law,
    )
    flat = ms.meshes.rectangle(0.1, 0.06, cells=(2, 1), diagonals="aligned", order=2)
    points = flat.rest_positions
    raised = np.array([0.0, 0.0, 0.03]) + points + 2.0 * points[:, :1] ** 2 * np.array([0.0, 0.0, 1.0])
    six = ms.Shell(
        ms.QuadraticTriangleMesh(raised, flat.elements),
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.3,
        mass_density=1e3,
        remanent_magnetization=magnetization(flat.n_elements),
        **law,
    )
    box = ms.meshes.box((0.06, 0.02, 0.02), cells=(2, 1, 1)).transformed(translation=(0.0, 0.1, 0.0))
    solid = ms.Solid(
        box,
        material=ms.StableNeoHookean(young_modulus=2e5, poisson_ratio=0.3),
        mass_density=1e3,
        element="linear",
        remanent_magnetization=magnetization(box.n_tetrahedra),
        skin=ms.Skin(
            thickness=1e-3,
            mass_density=800.0,
            faces=box.faces_at(z=0.02),
            remanent_magnetization=(4e4, 1e4, 2e4),
            **law,
        ),
        **law,
    )
    bodies = [sheet, six, solid]
    supports = [
        ms.Clamp(MESH.edges_at(x=0.0), body=sheet),
        ms.Clamp(six.mesh.edges_at(x=0.0), body=six),
        ms.Pin(solid.mesh.vertices_at(x=0.0), body=solid),
    ]
    scene = ms.Scene(bodies, supports=supports, field=[ms.UniformField(), DIPOLES], gravity=(0.2, 0.1, -9.81))
    inputs = {"applied_flux_density": np.array([2e-3, -1e-3, 3e-3]), "field_factor": 0.7}
    if not moves:
        return Kind(scene, inputs, fixed=EXACT, reach=REACH)
    fixed = {**EXACT, "steps": 3, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, {**inputs, "time_step": 2e-3}, ms.simulate, fixed=fixed, step=1e-4, reach=REACH)
