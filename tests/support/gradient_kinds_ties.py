"""Kinds of scene whose supports tie displacements to each other, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import DIPOLES
from gradient_scenes import Kind
from gradient_world import EXACT, REACH, RNG

import magshell as ms

MATTER = {"young_modulus": 1e6, "poisson_ratio": 0.35, "mass_density": 1e3}
SLANTED = (0.6, 0.0, 0.8)


def _sides(mesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices of two opposite sides beyond the clamp, in the directions of y."""
    beyond = np.flatnonzero(mesh.rest_positions[:, 0] > 1e-6)
    return tuple(np.intersect1d(beyond, mesh.vertices_at(y=y)) for y in (0.0, 0.06))


def _tied(body, clamp) -> list:
    """Return supports of all kinds for a clamped body: two sides with a given difference, vertices with one
    displacement along a slanted direction, and vertices that follow one that is moved.
    """
    free, (below, above) = body.mesh.rest_positions, _sides(body.mesh)
    inner = np.flatnonzero((free[:, 1] > 0.01) & (free[:, 1] < 0.05) & (free[:, 0] > 0.05))
    near = free[inner, 0] < 0.08
    led, slanted = inner[near], inner[~near]
    return [
        clamp,
        ms.Periodic(below, above, "xz", displacement=(1e-4, 0.0, -2e-4)),
        ms.Periodic(below, above, "y"),
        ms.Pin(led[:1], "z", displacement=(0.0, 0.0, 3e-4), rotation=(0.0, 0.0, 0.1)),
        ms.EqualDisplacement(led, "z"),
        ms.EqualDisplacement(slanted, SLANTED),
    ]


def _sheet(six: bool) -> tuple[ms.Shell, list]:
    mesh = ms.meshes.rectangle(0.1, 0.06, cells=(4, 4) if not six else (3, 2))
    if six:
        mesh = ms.QuadraticTriangleMesh.from_triangles(mesh)
    sheet = ms.Shell(mesh, thickness=1e-3, **MATTER)
    return sheet, _tied(sheet, ms.Clamp(mesh.edges_at(x=0.0)))


def _solid() -> tuple[ms.Solid, list]:
    matter = ms.StVenantKirchhoff(young_modulus=1e6, poisson_ratio=0.35)
    solid = ms.Solid(ms.meshes.box((0.1, 0.06, 0.02), cells=(3, 3, 1)), material=matter, mass_density=1e3)
    clamp = ms.Pin(solid.mesh.vertices_at(x=0.0))
    return solid, _tied(solid, clamp)


def tied_sheet_at_rest(six: bool) -> Kind:
    sheet, supports = _sheet(six)
    scene = ms.Scene(sheet, supports=supports, field=[ms.UniformField(), DIPOLES], gravity=(0.3, 0.2, -1.0))
    inputs = {"applied_flux_density": (1e-3, 0.0, 2e-3), "gravity_factor": 0.9, "support_factor": 0.8}
    inputs["remanent_magnetization"] = (2e4, 0.0, 1e4)
    return Kind(scene, inputs, fixed=EXACT, reach=REACH)


def tied_solid_at_rest() -> Kind:
    solid, supports = _solid()
    scene = ms.Scene(solid, supports=supports, gravity=(0.3, 0.2, -9.81))
    return Kind(scene, {"gravity_factor": 0.9, "support_factor": 0.8}, fixed=EXACT, reach=REACH)


def tied_in_motion(integrator, solid: bool, **options) -> Kind:
    body, supports = _solid() if solid else _sheet(six=False)
    scene = ms.Scene(body, supports=supports, gravity=(0.3, 0.2, -9.81))
    fixed = {"steps": 3, "integrator": integrator, "progress": False, **EXACT, **options}
    inputs = {
        "time_step": 4e-3,
        "gravity_factor": np.linspace(0.5, 1.0, 4),
        "velocities": 1e-2 * RNG.standard_normal((body.mesh.n_vertices, 3)),
    }
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=REACH, in_time=3)


TIE_MAKERS = {
    "a tied sheet at rest": lambda: tied_sheet_at_rest(six=False),
    "a tied six-node sheet at rest": lambda: tied_sheet_at_rest(six=True),
    "a tied solid at rest": tied_solid_at_rest,
    "a tied sheet in motion, euler": lambda: tied_in_motion(ms.ImplicitEuler(), solid=False),
    "a tied solid in motion, tr_bdf2": lambda: tied_in_motion(
        ms.TRBDF2(), solid=True, adjoint_storage="factors"
    ),
}
