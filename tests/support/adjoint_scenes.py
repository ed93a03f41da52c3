"""Makes the scenes by which gradients of equilibria are checked."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")
BENDINGS = ("midedge", "hinge")
MESH = ms.meshes.rectangle(0.1, 0.06, cells=(3, 2), irregular=0.2, seed=3)
N_F, N_E, N_V = MESH.n_faces, MESH.n_edges, MESH.n_vertices
FREE = MESH.vertices_at(x=0.1)
RNG = np.random.default_rng(7)
MAGNETIZATION = np.array((3e4, 1e4, 2e4)) * RNG.uniform(0.7, 1.3, (N_F, 3))
YOUNG = RNG.uniform(0.8e6, 1.2e6, N_F)
WEIGHTS = torch.from_numpy(RNG.standard_normal((N_V, 3)))
ROTATION_WEIGHTS = torch.from_numpy(RNG.standard_normal(N_E)) * 0.01


def shell(bending="midedge", mesh=MESH):
    return ms.Shell(
        mesh, thickness=1e-3, young_modulus=1e6, poisson_ratio=0.4, mass_density=2e3, bending=bending
    )


CLAMP = ms.Clamp(MESH.edges_at(x=0.0), displacement=(-2e-4, 1e-4, 2e-3), rotation=(0.1, 0.3, -0.05))
POINT = ms.PointLoad(FREE, (1e-3, 2e-3, 4e-3))
EDGE = ms.EdgeLoad(MESH.edges_at(x=0.1), (0.0, 0.02, 0.05))
AREA = ms.AreaLoad((0.1, 0.0, 1.0))
COUPLE = ms.EdgeCouple(MESH.edges_at(y=0.0), 1e-4)
DIPOLES = ms.Dipoles([[0.12, 0.02, -0.1], [0.05, 0.1, 0.09]], [[0.5, 0.2, 1.0], [0.3, -0.8, 0.4]])
GRID = ms.SampledField.from_function(
    DIPOLES.flux_density, (-0.04, -0.04, -0.06), (0.15, 0.12, 0.065), (5, 4, 3)
)
PLANE_GRID = ms.SampledField.from_function(
    lambda x: np.stack([0.02 * x[:, 2], 0.1 * x[:, 0] ** 2, 0.01 + 0.1 * x[:, 0]], axis=1),
    (-0.04, 0, -0.06),
    (0.15, 0, 0.065),
    (6, 1, 2),
)


def everything(bending="midedge"):
    """Build a scene with a clamp that moves, all loads, gravity, and a uniform field plus dipoles and a grid."""
    return ms.Scene(
        shell(bending),
        supports=[CLAMP],
        loads=[POINT, EDGE, AREA, COUPLE],
        field=[ms.UniformField(), DIPOLES, GRID, PLANE_GRID],
        gravity=(1.0, 0.5, -9.81),
    )


SOLVE_INPUTS = {
    "remanent_magnetization": MAGNETIZATION,
    "applied_flux_density": (1e-3, -2e-3, 3e-3),
    "thickness": RNG.uniform(0.9e-3, 1.1e-3, N_F),
    "young_modulus": YOUNG,
    "poisson_ratio": RNG.uniform(0.2, 0.45, N_F),
    "mass_density": RNG.uniform(1e3, 3e3, N_F),
    "curvature_scale": RNG.uniform(0.8, 1.2, N_E),
    "load_factor": 0.9,
    "gravity_factor": 0.8,
    "field_factor": 1.1,
    "support_factor": 0.7,
}
VALUES = {
    "point load": (POINT, "force", RNG.uniform(-4e-3, 4e-3, (len(FREE), 3))),
    "one point load for all": (POINT, "force", (1e-3, 2e-3, 4e-3)),
    "edge load": (EDGE, "force_per_length", (0.0, 0.02, 0.05)),
    "area load": (AREA, "force_per_area", RNG.uniform(-1, 1, (N_F, 3))),
    "couple": (COUPLE, "couple_per_length", 2e-4),
    "displacement": (CLAMP, "displacement", (-2e-4, 1e-4, 2e-3)),
    "rotation": (CLAMP, "rotation", (0.2, 0.4, -0.3)),
    "center": (CLAMP, "center", (0.01, 0.02, 0.03)),
    "dipole positions": (DIPOLES, "positions", DIPOLES.positions),
    "dipole moments": (DIPOLES, "moments", DIPOLES.moments),
    "grid": (GRID, "flux_density", GRID.flux_density(np.zeros((5, 4, 3, 3)) + 0.01)),
    "plane grid": (PLANE_GRID, "flux_density", RNG.uniform((0, 0, 9e-3), (1e-3, 1e-3, 12e-3), (6, 1, 2, 3))),
}
DEFAULTS = {"remanent_magnetization": MAGNETIZATION, "applied_flux_density": (1e-3, -2e-3, 3e-3)}
