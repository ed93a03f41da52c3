"""Soft solids under a pressure inside: a ventricle and a thick tube."""

from __future__ import annotations

import numpy as np

import magshell as ms


def ventricle(
    cells: int, layers: int, *, pressure: float = 10e3, wall: float = 3e-3, **material: object
) -> ms.Scene:
    """Return a quarter of the truncated ventricle of Land et al. 2015, problem 2, its base held, a pressure inside [Pa].

    wall: its thickness [m]. material: replaces properties of Guccione's material.
    """
    unit = ms.meshes.box((1.0, 1.0, 1.0), cells=(cells, cells, layers))
    a, b, depth = unit.rest_positions.T  # a square that becomes a quarter of a disc
    a, b = a * np.sqrt(1.0 - b**2 / 2.0), b * np.sqrt(1.0 - a**2 / 2.0)
    radius, around = np.hypot(a, b), np.arctan2(b, a)
    short, long = 7e-3 + wall * depth, 17e-3 + wall * depth  # m, half axes of the shells
    down = -np.pi + radius * (np.pi - np.arccos(5e-3 / long))
    aside = -short * np.sin(down)
    x = np.stack([aside * np.cos(around), aside * np.sin(around), long * np.cos(down)], axis=1)
    mesh = ms.TetMesh(x, unit.tetrahedra[:, [0, 2, 1, 3]])
    properties: dict = {
        "stiffness": 10e3,
        "fibre_exponent": 1.0,
        "cross_fibre_exponent": 1.0,
        "fibre_shear_exponent": 1.0,
        "bulk_modulus": 1e7,
        "fibres": (0.0, 0.0, 1.0),
    } | material
    solid = ms.Solid(mesh, material=ms.Guccione(**properties))
    base = np.flatnonzero(np.abs(solid.mesh.rest_positions[:, 2] - 5e-3) < 1e-9)
    inside = ms.Pressure(pressure, faces=sides_between(mesh, unit.vertices_at(z=0.0)))
    supports = [ms.Pin(base), ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    return ms.Scene(solid, supports=supports, loads=[inside])


def thick_tube(pressure: float) -> ms.Scene:
    """Return an eighth of a closed thick tube, nearly incompressible and free to extend, with a pressure inside [Pa]."""
    inner, outer, half = 0.01, 0.015, 0.02  # m
    unit = ms.meshes.box((1.0, 1.0, 1.0), cells=(6, 4, 4))
    radial, around, along = unit.rest_positions.T
    angle = 0.5 * np.pi * around
    radius = inner + (outer - inner) * radial
    x = np.stack([radius * np.cos(angle), radius * np.sin(angle), half * along], axis=1)
    mesh = ms.TetMesh(x, unit.tetrahedra)
    solid = ms.Solid(mesh, material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4999))
    ends = (
        pressure * inner**2 / (outer**2 - inner**2)
    )  # axial traction [Pa] that rigid end caps transmit to the wall
    loads = [
        ms.Pressure(pressure, faces=sides_between(mesh, unit.vertices_at(x=0.0))),
        ms.Pressure(-ends, faces=sides_between(mesh, unit.vertices_at(z=1.0))),
    ]
    return ms.Scene(solid, supports=[ms.SymmetryPlane(normal) for normal in np.eye(3)], loads=loads)


def sides_between(mesh: ms.TetMesh, vertices: np.ndarray) -> np.ndarray:
    """Return the faces of a quadratic solid, four a side, on the sides of its mesh whose corners are all among vertices."""
    return (4 * mesh.faces_between(vertices)[:, None] + np.arange(4)).ravel()
