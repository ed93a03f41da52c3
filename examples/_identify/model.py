"""The sheet, its true properties, and the measurement of its shapes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

import magshell as ms

LENGTH, WIDTH, THICKNESS = 50e-3, 30e-3, 1e-3  # m
MASS_DENSITY, GRAVITY = 1e3, (0.0, 0.0, -9.81)  # kg/m3, m/s2
FIELDS = 20e-3 * np.array(
    [(0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 0)]
)  # T: three load cases, and one without
NOISE = 0.1e-3  # m, standard deviation of each measured coordinate
STRIPS = (5, 1)  # of equal magnetization: how many along and across
INCLUSION, EDGE = ((18e-3, 16e-3), 8e-3), 1.5e-3  # its center and radius, and how sharp it is, m


def true_young_modulus(points: np.ndarray) -> np.ndarray:
    """Return Young's modulus at points (n, 3) m, (n,) Pa: 1 to 2.5 MPa, smooth, and a stiff inclusion of 10 MPa."""
    x, y = points[:, 0] / LENGTH, points[:, 1] / WIDTH
    wave = 0.5 + 0.5 * np.cos(2 * np.pi * (x - 0.3 * y)) * np.cos(np.pi * y)
    center, radius = INCLUSION
    distance = np.hypot(points[:, 0] - center[0], points[:, 1] - center[1])
    inside = 1 / (1 + np.exp((distance - radius) / EDGE))
    return 1e6 * 2.5 ** ((1 - inside) * wave) * 10**inside


def true_magnetization() -> np.ndarray:
    """Return the magnetization of each region, (n_regions, 3) A/m: 35 to 45 kA/m in independent random directions."""
    rng = np.random.default_rng(11)
    directions = rng.standard_normal((STRIPS[0] * STRIPS[1], 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return rng.uniform(35e3, 45e3, (len(directions), 1)) * directions


@dataclass(frozen=True)
class Sheet:
    """The sheet and its regions. regions: the region of each face, (n_f,)."""

    scene: ms.Scene
    regions: np.ndarray

    @property
    def n_regions(self) -> int:
        return int(self.regions.max()) + 1

    @property
    def mesh(self) -> ms.TriangleMesh:
        return self.scene.mesh


def sheet(cells, diagonals: str = "alternating", weight: bool = True, strips=STRIPS) -> Sheet:
    """Build the sheet, clamped at x = 0, with the true Young's modulus."""
    mesh = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells, diagonals=diagonals)
    shell = ms.Shell(
        mesh,
        thickness=THICKNESS,
        young_modulus=true_young_modulus(mesh.face_barycenters),
        mass_density=MASS_DENSITY,
    )
    scene = ms.Scene(
        shell,
        supports=[ms.Clamp(mesh.edges_at(x=0.0))],
        field=ms.UniformField(),
        gravity=GRAVITY if weight else None,
    )
    column = np.floor(mesh.face_barycenters[:, 0] / LENGTH * strips[0]).astype(np.int64)
    row = np.floor(mesh.face_barycenters[:, 1] / WIDTH * strips[1]).astype(np.int64)
    return Sheet(scene, column + strips[0] * row)


def measured(cells, noise: float, same_mesh: bool = False, seed: int = 7) -> np.ndarray:
    """Return the measured positions of the vertices in every field, (4, n_v, 3) m.

    They are computed on another mesh, with four times as many cells of four faces each, so that the inverse problem is
    not solved with the model that made its data; `same_mesh` computes them on the same mesh. Noise is added to every
    coordinate.
    """
    exact = _exact(tuple(cells), same_mesh)
    return exact + noise * np.random.default_rng(seed).standard_normal(exact.shape)


@cache
def _exact(cells: tuple[int, int], same_mesh: bool) -> np.ndarray:
    seen = sheet(cells) if same_mesh else sheet((2 * cells[0], 2 * cells[1]), "crossed")
    rest = ms.equilibrium(
        seen.scene, remanent_magnetization=true_magnetization()[seen.regions], applied_flux_density=FIELDS
    )
    points = ms.meshes.rectangle(LENGTH, WIDTH, cells=cells).rest_positions
    return rest.positions[:, [seen.mesh.nearest_vertex(point) for point in points]]
