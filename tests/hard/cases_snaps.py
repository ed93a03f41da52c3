"""Snap-through and snap-back: loads beyond a limit point, and paths past it."""

from __future__ import annotations

import numpy as np
from answers import at_rest, both, holds, near
from registry import case

import magshell as ms
from benchmarks.cases import cylinder_roof

HALF_SPAN, RISE, DEPTH, THICKNESS, YOUNG_MODULUS = 1.0, 0.2, 0.5, 1e-3, 1e6


def toggle(rise: float = RISE, thickness: float = THICKNESS) -> tuple[ms.Scene, np.ndarray]:
    """Return a scene of two plates that lean on each other, hinged along feet and ridge, and the ridge's vertices.

    Von Mises' truss in St. Venant-Kirchhoff material: P = E h b z (z0^2 - z^2) / l^3 at the height z, so the limit
    points are at z = +- z0 / sqrt(3). The scene holds their load.
    """
    x = (-HALF_SPAN, -HALF_SPAN, 0.0, 0.0, HALF_SPAN, HALF_SPAN)
    y, z = (0.0, DEPTH) * 3, (0.0, 0.0, rise, rise, 0.0, 0.0)
    mesh = ms.TriangleMesh(np.stack([x, y, z], axis=1), [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]])
    sheet = ms.Shell(
        mesh,
        thickness=thickness,
        young_modulus=YOUNG_MODULUS,
        poisson_ratio=0.0,
        bending="hinge",
        curvature_scale=1e-3,  # its folds are hinges
    )
    ridge = np.array([2, 3])
    load = ms.PointLoad(ridge, (0, 0, -limit_load(rise, thickness) / 2.0))
    return ms.Scene(sheet, supports=[ms.Pin([0, 1, 4, 5])], loads=[load]), ridge


def limit_load(rise: float = RISE, thickness: float = THICKNESS) -> float:
    bar = float(np.hypot(HALF_SPAN, rise))
    return 2.0 * YOUNG_MODULUS * thickness * DEPTH * (rise / bar) ** 3 / (3.0 * np.sqrt(3.0))


def heights(factor: float, rise: float = RISE) -> np.ndarray:
    """Return the real heights at which the truss carries that multiple of its limit load, ascending."""
    load = factor * 2.0 * rise**3 / (3.0 * np.sqrt(3.0))  # P l^3 / (E h b)
    roots = np.roots([-1.0, 0.0, rise**2, -load])
    return np.sort(roots[np.abs(roots.imag) < 1e-9 * rise].real)


@case("{} times the limit load of a truss, at once", over=(0.99, 1.01, 10.0))
def toggle_under_a_load(factor):
    scene, ridge = toggle()
    found = ms.equilibrium(scene, load_factor=factor)
    height = found.positions[ridge, 2].mean()
    return both(near("height", height, heights(factor)[-1], rel=1e-5, scale=RISE), at_rest(found))


@case("a truss that has snapped, without its load: it stays")
def toggle_after_the_load():
    scene, ridge = toggle()
    snapped = ms.equilibrium(scene, load_factor=1.5)
    found = ms.equilibrium(scene, load_factor=0.0, start=snapped)
    return both(near("height", found.positions[ridge, 2].mean(), -RISE, rel=1e-6), at_rest(found))


@case("the path of a truss through both limit points")
def toggle_by_arc_length():
    scene, ridge = toggle()
    path = ms.follow_path(scene, load_factor=1.5, max_step=0.02, progress=False)
    limits = [point for point in path.critical if point.kind == "limit"]
    if len(limits) != 2:
        return holds("two limit points", False, str([point.kind for point in path.critical]))
    at = [point.positions[ridge, 2].mean() for point in limits]
    return both(
        near("loads at the limits", [1.5 * point.parameter for point in limits], (1.0, -1.0), rel=1e-5),
        near("heights there", at, np.array([RISE, -RISE]) / np.sqrt(3.0), rel=1e-3),
        near(
            "height at the end", path.positions[-1][ridge, 2].mean(), heights(1.5)[-1], rel=2e-2, scale=RISE
        ),
    )


def roof(
    thickness: float, load: float, cells: tuple[int, int] = (12, 12), nu: float = cylinder_roof.POISSON_RATIO
) -> ms.Scene:
    """Return a quarter of the shallow roof of the accuracy table, with a quarter of `load` [N] at its center."""
    mesh = cylinder_roof.quarter(cells)
    sheet = ms.Shell(
        mesh,
        thickness=thickness,
        young_modulus=cylinder_roof.YOUNG_MODULUS,
        poisson_ratio=nu,
    )
    hinge = mesh.vertices_at(x=cylinder_roof.RADIUS * np.sin(cylinder_roof.HALF_ANGLE))
    supports = [ms.Pin(hinge), ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    center = mesh.nearest_vertex((0, 0, cylinder_roof.RADIUS))
    return ms.Scene(sheet, supports=supports, loads=[ms.PointLoad(center, (0, 0, -load / 4.0))])


def sunk(scene: ms.Scene, positions: np.ndarray) -> np.ndarray:
    """Return the deflection of the center, in mm."""
    center = scene.mesh.nearest_vertex((0, 0, cylinder_roof.RADIUS))
    return cylinder_roof.RADIUS - positions[..., center, 2]


@case("a roof under 1.45 times its limit load, at once: no equilibrium is near")
def roof_snaps_through():
    scene = roof(cylinder_roof.THICKNESS, 1.0835 * cylinder_roof.FULL_LOAD)
    found = ms.equilibrium(scene)
    return both(near("deflection, mm", sunk(scene, found.positions), 29.374, rel=1e-2), at_rest(found))


@case("a roof that has snapped, without its load: it must snap back")
def roof_snaps_back():
    scene = roof(cylinder_roof.THICKNESS, 1.0835 * cylinder_roof.FULL_LOAD)
    found = ms.equilibrium(scene, load_factor=0.0, start=ms.equilibrium(scene))
    return both(
        near("deflection, mm", sunk(scene, found.positions), 0.0, rel=1e-6, scale=29.0), at_rest(found)
    )


@case("a thin roof, whose path turns back in load and in deflection")
def thin_roof_by_arc_length():
    """Compare with limit loads of 590 and -380 N at half the thickness: Sze, Liu, Lo (2004) and others since."""
    scene = roof(cylinder_roof.THICKNESS / 2.0, 1000.0)
    path = ms.follow_path(
        scene, until=lambda _, positions: sunk(scene, positions) > 27.0, max_step=0.001, progress=False
    )
    turns = np.diff(np.sign(np.diff(sunk(scene, path.positions))))
    limits = [1000.0 * point.parameter for point in path.critical if point.kind == "limit"]
    return both(
        near("upper and lower limit, N", [max(limits), min(limits)], (590.0, -380.0), rel=3e-2, scale=590.0),
        holds("the deflection turns back", bool(np.any(turns < 0)), f"{int(np.sum(turns != 0))} turns"),
    )
