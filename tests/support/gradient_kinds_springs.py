"""Kinds of scene with springs, dampers, foundations and creases, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH
from gradient_scenes import Kind
from gradient_world import EXACT, REACH

import magshell as ms

SOME = np.random.default_rng(23)
TIPS = MESH.rest_positions[MESH.vertices_at(x=0.1)]


def _on_springs(damped: bool, foundations: bool = True) -> tuple[list, list, list]:
    """Return bodies, supports and springs of all kinds: a clamped sheet, and a weight that hangs from it."""
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=1e3)
    weight = ms.RigidBody(mass=2e-3, inertia=1e-6, center=(0.08, 0.02, -0.04))
    clamp = ms.Clamp(MESH.edges_at(x=0.0), body=sheet)
    n = len(TIPS)
    damper = {"damping": SOME.uniform(0.01, 0.02, n)} if damped else {}
    faces = np.arange(3, 9)
    springs = [
        ms.Spring(
            (sheet, 0.95 * TIPS + 0.05 * MESH.rest_positions.mean(axis=0)),
            TIPS + np.array((0.01, 0.0, 0.03)),
            stiffness=SOME.uniform(0.5, 1.0, n),
            rest_length=0.02,
            **damper,
        ),
        ms.Spring((sheet, TIPS[1]), (0.09, 0.01, 0.02), stiffness=0.4),
        ms.Spring(
            (weight, (0.08, 0.02, -0.035)),
            (sheet, 0.7 * TIPS[0] + 0.3 * MESH.rest_positions.mean(axis=0)),
            stiffness=3.0,
            damping=0.05,
        ),
        ms.Spring((weight, (0.09, 0.02, -0.04)), stiffness=0.7, **({"damping": 0.02} if damped else {})),
        ms.Spring(
            (sheet, TIPS),
            stiffness=SOME.uniform(0.2, 0.4, n),
            direction=(0.3, -0.2, 1.0),
            **({"damping": 0.03} if damped else {}),
        ),
        ms.ElasticFoundation(
            SOME.uniform(400, 800, len(faces)),
            faces=faces,
            direction="normal",
            body=sheet,
            **({"damping": 9.0} if damped else {}),
        ),
        ms.ElasticFoundation(200.0, body=sheet),
    ]
    return [sheet, weight], [clamp], springs if foundations else springs[:-2]


def on_springs_at_rest(foundations: bool = True) -> Kind:
    bodies, supports, springs = _on_springs(damped=False, foundations=foundations)
    scene = ms.Scene(
        bodies, supports=supports, loads=springs, gravity=(0.2, 0.1, -9.81), allow_rigid_motions=True
    )
    return Kind(scene, {"gravity_factor": 0.9}, fixed=EXACT, reach=REACH)


def on_springs_in_motion(integrator, damped: bool, foundations: bool = True, **options) -> Kind:
    """Build a motion in which all numbers of the springs change that can."""
    bodies, supports, springs = _on_springs(damped, foundations)
    scene = ms.Scene(
        bodies, supports=supports, loads=springs, gravity=(0.2, 0.1, -9.81), allow_rigid_motions=True
    )
    fixed = {"steps": 3, "integrator": integrator, "progress": False, **EXACT, **options}
    inputs = {"time_step": 4e-3, "gravity_factor": np.linspace(0.5, 1.0, 4)}
    return Kind(scene, inputs, ms.simulate, fixed=fixed, reach=REACH, in_time=3)


def _creased(bending: str) -> tuple[ms.Shell, ms.Clamp]:
    inner = MESH.interior_edges
    lines = [
        ms.Crease(inner[[3, 9]], stiffness=SOME.uniform(1e-4, 3e-4, 2), angle=(0.3, -0.2)),
        ms.Crease(inner[[5]], stiffness=2e-4),
    ]
    sheet = ms.Shell(
        MESH,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        bending=bending,
        creases=lines,
    )
    return sheet, ms.Clamp(MESH.edges_at(x=0.0))


def creased_at_rest() -> Kind:
    sheet, clamp = _creased("midedge")
    scene = ms.Scene(sheet, supports=[clamp], gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"gravity_factor": 0.3}, fixed=EXACT, reach=REACH)


def creased_in_motion() -> Kind:
    sheet, clamp = _creased("hinge")
    scene = ms.Scene(sheet, supports=[clamp], gravity=(0.2, 0.1, -9.81))
    fixed = {"steps": 3, "integrator": ms.TRBDF2(), "progress": False, **EXACT}
    return Kind(scene, {"time_step": 3e-3}, ms.simulate, fixed=fixed, reach=REACH, in_time=3)
