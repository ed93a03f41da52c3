"""Kinds of scene with sheets of six-node elements, curved at rest, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import DIPOLES, MESH
from gradient_scenes import Kind
from gradient_world import EXACT, FACTORS, IN_WATER, REACH, RNG, under

import magshell as ms
from magshell import obstacles as ob


def _bent(points):
    return points + 3.0 * points[:, :1] ** 2 * (0, 0, 1) + 2.0 * points[:, 1:2] ** 2 * (0, 0, 1)


def _magnetization(n: int) -> np.ndarray:
    return 1e4 * np.array((3.0, 1.0, 2.0)) * RNG.uniform(0.7, 1.3, (n, 3))


def curved(own_magnetization: bool) -> ms.Shell:
    coarse = ms.meshes.rectangle(0.1, 0.06, cells=(2, 1), diagonals="aligned")
    flat = ms.QuadraticTriangleMesh.from_triangles(coarse)
    mesh = ms.QuadraticTriangleMesh(_bent(flat.rest_positions), flat.elements)
    n = mesh.n_elements
    return ms.Shell(
        mesh,
        thickness=RNG.uniform(0.9e-3, 1.1e-3, n),
        young_modulus=RNG.uniform(0.8e6, 1.2e6, n),
        poisson_ratio=RNG.uniform(0.3, 0.4, n),
        mass_density=RNG.uniform(0.8e3, 1.2e3, n),
        remanent_magnetization=_magnetization(n) if own_magnetization else None,
    )


def six_nodes_at_rest() -> Kind:
    """Build an equilibrium with a clamp that moves, all loads, gravity, fields, a floor, and a sheet of three-node
    elements.
    """
    sheet = curved(own_magnetization=True)
    mesh = sheet.mesh
    other = ms.Shell(
        MESH.transformed(translation=(0.01, 0, 0.02)),
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        remanent_magnetization=(1e4, 0, 2e3),
    )
    loads = [
        ms.PointLoad(mesh.vertices_at(x=0.1), (1e-4, 2e-4, -2e-4), body=sheet),
        ms.EdgeLoad(mesh.edges_at(x=0.1), (0, 1e-2, -1e-2), body=sheet),
        ms.AreaLoad((0.1, 0, 0.2), faces=[1, 2, 7], body=sheet),
        ms.SurfaceTension(RNG.uniform(0.1, 0.2, 3), faces=[1, 4, 7], body=sheet),
        ms.Pressure(RNG.uniform(-1.0, 2.0, 3), faces=[0, 2, 9], body=sheet),
        ms.EdgeCouple(mesh.edges_at(x=0.1), 2e-4, body=sheet),
        ms.EdgeCouple(mesh.edges_at(y=0.06), (3e-4, 0, 1e-4), body=sheet),
    ]
    supports = [
        ms.Clamp(mesh.edges_at(x=0.0), displacement=(1e-4, 0, 5e-4), rotation=(0, 0.1, 0.05), body=sheet),
        ms.Clamp(other.mesh.edges_at(x=0.01), body=other),
    ]
    floor = ms.Contact(under(ob.Plane, 2e-3), contact_stiffness=5.0, offset=1e-3, body=sheet)
    scene = ms.Scene(
        [sheet, other],
        supports=supports,
        loads=loads,
        contacts=[floor],
        field=[ms.UniformField(), DIPOLES],
        gravity=(0.2, 0.1, -9.81),
    )
    inputs = {**FACTORS, "applied_flux_density": (1e-3, -5e-4, 2e-3)}
    return Kind(scene, inputs, fixed=EXACT, step=1e-5, reach=REACH)


def six_nodes_in_motion() -> Kind:
    """Build a motion of a sheet thrown through water onto a ball with friction."""
    sheet = curved(own_magnetization=False)
    ball = under(ob.Sphere, 8e-3)
    rubbing = ms.Contact(ball, contact_stiffness=50.0, offset=1e-4, friction_coefficient=0.4)
    scene = ms.Scene(
        sheet,
        contacts=[rubbing],
        field=ms.UniformField(),
        gravity=(0, 0.3, -9.81),
        water=ms.Water(800.0, (0.05, -0.02, 0.01), **IN_WATER),
        allow_rigid_motions=True,
    )
    n_v = sheet.mesh.n_vertices
    inputs = {
        "remanent_magnetization": _magnetization(sheet.mesh.n_elements),
        "applied_flux_density": (1e-3, 0.0, 4e-3),
        "velocities": np.array([0.05, 0.03, -0.3]) + 1e-2 * RNG.standard_normal((n_v, 3)),
        "damping": RNG.uniform(1e-4, 2e-4, n_v),
        "stiffness_damping": 1e-3,
        "time_step": 2e-3,
    }
    reach = {**REACH, "damping": 1e-2, "stiffness_damping": 1e-1}
    fixed = {**EXACT, "steps": 4, "integrator": ms.TRBDF2(), "progress": False}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, step=1e-5, reach=reach)
