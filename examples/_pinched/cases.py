"""Two thin shells under point forces, of six-node elements: cases B2 and A4 of `python -m benchmarks accuracy`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import magshell as ms


@dataclass(frozen=True)
class Case:
    """A shell under point forces.

    solve: maps cells to a result, an Equilibrium or a LinearResponse. deflection: maps a result and its first mesh to that
    of the loaded point, m. project: onto the surface. exact: the limit of Kirchhoff-Love theory, m.
    """

    name: str
    solve: Callable[[tuple[int, int]], Any]
    loaded: Callable[[Any], int]
    axis: int
    project: Callable[[np.ndarray], np.ndarray]
    exact: float

    def output(self, result: Any) -> Callable[[Any], Any]:
        """Return the deflection of the loaded point as a function of a result, for the vertices of this result's mesh."""
        vertex = self.loaded(result.scene.mesh)
        return lambda found: -found.displacements[vertex, self.axis]


CYLINDER_RADIUS, SPHERE_RADIUS = 300.0, 10.0


def onto_cylinder(points: np.ndarray) -> np.ndarray:
    factors = CYLINDER_RADIUS / np.linalg.norm(points[:, [0, 2]], axis=1)
    return np.stack([factors * points[:, 0], points[:, 1], factors * points[:, 2]], axis=1)


def onto_sphere(points: np.ndarray) -> np.ndarray:
    return SPHERE_RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True)


def pinched_cylinder(cells: tuple[int, int]) -> ms.LinearResponse:
    """Return the small deflection of an eighth of a cylinder on rigid diaphragms under two opposite forces of 1 N."""
    mesh = ms.meshes.cylinder(CYLINDER_RADIUS, 300.0, (0.0, np.pi / 2), cells=cells, order=2)
    sheet = ms.Shell(mesh, thickness=3.0, young_modulus=3e6, poisson_ratio=0.3)
    supports = [ms.Pin(mesh.vertices_at(y=300.0), "xz"), *map(ms.SymmetryPlane, np.eye(3))]
    force = ms.PointLoad(mesh.nearest_vertex((0, 0, CYLINDER_RADIUS)), (0, 0, -0.25))
    return ms.linear_response(ms.Scene(sheet, supports=supports, loads=[force]))


def pulled_hemisphere(cells: tuple[int, int]) -> ms.Equilibrium:
    """Return a quarter of a hemisphere with a hole, pulled and pushed at its rim by forces of 400 N, far beyond its
    thickness."""
    span = (np.radians(18.0), np.pi / 2, np.pi / 2)
    mesh = ms.meshes.spherical_cap(SPHERE_RADIUS, *span, cells=cells, order=2)
    sheet = ms.Shell(mesh, thickness=0.04, young_modulus=6.825e7, poisson_ratio=0.3)
    pulled, pushed = (mesh.nearest_vertex(SPHERE_RADIUS * axis) for axis in np.eye(3)[:2])
    supports = [*map(ms.SymmetryPlane, np.eye(3)[:2]), ms.Pin(pulled, "z")]
    loads = [ms.PointLoad(pulled, (200.0, 0, 0)), ms.PointLoad(pushed, (0, -200.0, 0))]
    return ms.equilibrium(ms.Scene(sheet, supports=supports, loads=loads))


CYLINDER = Case(
    "pinched cylinder",
    pinched_cylinder,
    lambda mesh: mesh.nearest_vertex((0, 0, CYLINDER_RADIUS)),
    2,
    onto_cylinder,
    1.82842e-5,
)
HEMISPHERE = Case(
    "pulled hemisphere",
    pulled_hemisphere,
    lambda mesh: mesh.nearest_vertex((0, SPHERE_RADIUS, 0)),
    1,
    onto_sphere,
    8.1495,
)
