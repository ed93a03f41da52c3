"""Kinds of scene with sheets that have grown and bent by themselves, for gradient_kinds.py."""

import numpy as np
from adjoint_scenes import MESH, N_F
from gradient_kinds_six_nodes import curved
from gradient_scenes import Kind
from gradient_world import EXACT, REACH, RNG, VISCOUS

import magshell as ms

_DOME = ms.TriangleMesh(MESH.rest_positions + 4.0 * MESH.rest_positions[:, :1] ** 2 * (0, 0, 1), MESH.faces)


def _tensors(n: int, middle: float, size: float) -> np.ndarray:
    """Return random symmetric tensors of each face, about `middle` times unity."""
    some = size * RNG.uniform(-1, 1, (n, 3, 3))
    return middle * np.eye(3) + some + np.swapaxes(some, 1, 2)


def _clamped(sheet: ms.Shell, **more) -> ms.Scene:
    return ms.Scene(sheet, supports=[ms.Clamp(sheet.mesh.edges_at(x=0.0))], **more)


def _sheet(mesh, bending: str, growth, rest_curvature) -> ms.Shell:
    return ms.Shell(
        mesh,
        thickness=1e-3,
        young_modulus=1e6,
        poisson_ratio=0.4,
        mass_density=1e3,
        bending=bending,
        curvature_scale=RNG.uniform(0.8, 1.2, mesh.n_edges),
        growth=growth,
        rest_curvature=rest_curvature,
    )


def grown_at_rest(bending: str) -> Kind:
    """Build a curved sheet with a different growth in each face, under a weight."""
    sheet = _sheet(_DOME, bending, _tensors(N_F, 1.02, 0.01), _tensors(N_F, 3.0, 2.0))
    scene = _clamped(sheet, gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"gravity_factor": 1.0}, fixed=EXACT, reach=_REACH, step=1e-5)


def grown_evenly() -> Kind:
    """Build a sheet with one growth number for all faces, and one curvature tensor.

    The sheet is soft in one direction: the lowest eigenvalue of its Hessian, scaled by the diagonal, is 1e-6 of the
    largest. The step is therefore longer than in other kinds. Rest positions are moved by no more than a hundredth of a
    millimetre, within which the sheet keeps its branch.
    """
    sheet = _sheet(MESH, "midedge", 0.99, np.diag([8.0, 1.0, 1.0]))
    return Kind(_clamped(sheet), {}, fixed=EXACT, reach={**_REACH, "rest_positions": 0.01}, step=1e-3)


def grown_six_nodes() -> Kind:
    """Build a grown sheet of six-node triangles under its weight, without which no modulus of all faces would matter."""
    sheet = curved(own_magnetization=False)
    n = sheet.mesh.n_elements
    grown = ms.Shell(
        sheet.mesh,
        thickness=1e-3,
        young_modulus=sheet.young_modulus,
        poisson_ratio=sheet.poisson_ratio,
        mass_density=1e3,
        growth=_tensors(n, 1.02, 0.01),
        rest_curvature=_tensors(n, 3.0, 2.0),
    )
    scene = _clamped(grown, gravity=(0.2, 0.1, -9.81))
    return Kind(scene, {"gravity_factor": 1.0}, fixed=EXACT, reach=_REACH, step=1e-5)


def growing(integrator, in_time: int = 0, six_nodes: bool = False, **keywords) -> Kind:
    """Build a motion with growth and all kinds of viscosity, whose strains have a history."""
    if six_nodes:
        mesh = curved(own_magnetization=False).mesh
        sheet = ms.Shell(
            mesh,
            thickness=1e-3,
            young_modulus=1e6,
            poisson_ratio=0.4,
            mass_density=1e3,
            growth=_tensors(mesh.n_elements, 1.02, 0.01),
            rest_curvature=RNG.uniform(2, 4, mesh.n_elements),
        )
    else:
        sheet = _sheet(_DOME, "midedge", RNG.uniform(1.01, 1.02, N_F), _tensors(N_F, 3.0, 2.0))
    inputs = {name: VISCOUS[name] for name in ("stiffness_damping", "maxwell_modulus", "maxwell_time")}
    inputs |= {"time_step": 2e-3}
    fixed = {**EXACT, "steps": 3, "integrator": integrator, "progress": False, **keywords}
    reach = {**_REACH, "stiffness_damping": 1e-2}
    return Kind(_clamped(sheet), inputs, ms.simulate, fixed=fixed, reach=reach, step=1e-5, in_time=in_time)


_REACH = {**REACH, "growth": 0.1, "rest_curvature": 10.0}

GROWTH_MAKERS = {
    "a grown sheet at rest": lambda: grown_at_rest("midedge"),
    "a grown sheet at rest, hinge": lambda: grown_at_rest("hinge"),
    "a grown sheet at rest, evenly": grown_evenly,
    "a grown six-node sheet at rest": grown_six_nodes,
    "a grown sheet in motion, tr_bdf2": lambda: growing(
        ms.TRBDF2(), adjoint_storage=ms.AdjointStorage("checkpoints", memory_budget=2e4)
    ),
    "a growing sheet in motion, euler": lambda: growing(ms.ImplicitEuler(), in_time=3),
    "a growing six-node sheet in motion": lambda: growing(ms.TRBDF2(), in_time=3, six_nodes=True),
}
