"""Strips and other sheets that several families of hard cases are made of."""

from __future__ import annotations

import numpy as np

import magshell as ms

LENGTH, WIDTH, THICKNESS, YOUNG_MODULUS = 0.1, 0.01, 1e-3, 1e6  # m, Pa
MAGNETIZATION = 4e4  # A/m


def strip(cells=(20, 2), length=LENGTH, width=WIDTH, **options) -> ms.TriangleMesh:
    return ms.meshes.rectangle(length, width, cells=cells, **options)


def shell(mesh: ms.TriangleMesh, **properties) -> ms.Shell:
    given = {"thickness": THICKNESS, "young_modulus": YOUNG_MODULUS, "poisson_ratio": 0.0, **properties}
    return ms.Shell(mesh, **given)


def ends(mesh: ms.TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges at the smallest x, and at the largest."""
    x = mesh.rest_positions[:, 0]
    return mesh.edges_at(x=x.min()), mesh.edges_at(x=x.max())


def cantilever(sheet: ms.Shell, force_per_length=None, **options) -> ms.Scene:
    """Return a scene clamped at its smallest x, with a dead line load [N/m] at the other end."""
    near, far = ends(sheet.mesh)
    loads = [] if force_per_length is None else [ms.EdgeLoad(far, force_per_length)]
    return ms.Scene(sheet, supports=[ms.Clamp(near)], loads=loads, **options)


def end_position(mesh: ms.TriangleMesh, positions: np.ndarray) -> np.ndarray:
    """Return the mean position of the vertices at the largest rest x, (3,) in m."""
    x = mesh.rest_positions[:, 0]
    return positions[mesh.vertices_at(x=x.max())].mean(axis=0)


def load_number(force_per_length: float, sheet: ms.Shell, length: float) -> float:
    """Return P L^2 / (E I) of a line load at the end."""
    return 12.0 * force_per_length * length**2 / (sheet.young_modulus[0] * sheet.thickness[0] ** 3)


def force_for(number: float, sheet: ms.Shell, length: float) -> float:
    """Return the line load [N/m] at the end for this P L^2 / (E I)."""
    return number / load_number(1.0, sheet, length)


def field_for(number: float, sheet: ms.Shell, length: float) -> float:
    """Return the flux density [T] that bends a strip magnetized along itself like an end force of this number."""
    return force_for(number, sheet, length) / (MAGNETIZATION * sheet.thickness[0])


def graded(mesh: ms.TriangleMesh, power: float = 2.0) -> ms.TriangleMesh:
    """Return a strip from x = 0 with its cells concentrated there."""
    positions = np.array(mesh.rest_positions)
    length = positions[:, 0].max()
    positions[:, 0] = length * (positions[:, 0] / length) ** power
    return ms.TriangleMesh(positions, mesh.faces)
