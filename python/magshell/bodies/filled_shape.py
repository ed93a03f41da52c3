"""The mass of what a closed surface holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._checks.scalars import positive
from ..mesh.triangle_mesh import TriangleMesh

if TYPE_CHECKING:
    from .._checks.kinds import Numbers


def filled(shape: TriangleMesh, mass_density: Numbers) -> dict[Any, Any]:
    """mass [kg], inertia [kg m2] and center [m] of a Rigid that fills it. Raises ValueError where it is open, or turned
    inside out."""
    density = positive("mass_density", "kg/m3", mass_density)
    volume, center, second = moments_of(shape)
    inertia = density * (np.trace(second) * np.eye(3) - second)
    return {"mass": density * volume, "inertia": inertia, "center": center}


def moments_of(shape: TriangleMesh) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, center and second moments about it of what a closed surface holds, by tetrahedra to the origin."""
    faces, points = shape.faces, shape.rest_positions
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    if (counts != 2).any():
        raise ValueError(
            f"a shape must be closed to have a mass density, but {np.sum(counts != 2)} of its edges are open"
        )
    middle = points.mean(axis=0)
    a, b, c = (points[faces[:, k]] - middle for k in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    if not volume > 0:
        raise ValueError("a shape holds no volume: its faces must look outwards")
    center = (volumes[:, None] * (a + b + c)).sum(axis=0) / (4.0 * volume)
    total = a + b + c
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / 20.0
    return volume, middle + center, second - volume * np.outer(center, center)
