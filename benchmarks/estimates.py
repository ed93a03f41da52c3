"""Effectivity of ms.error_estimate: the estimated error over the true one, on cases of the accuracy table."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import magshell as ms

from .cases import hemisphere, linear_cylinders, magnetic_strip, plates, shear_strip
from .cases.outcome import order_of
from .ratios import note
from .report import print_table

MOST = 1.25  # allowed effectivity, or its inverse, where the error is below LARGE and above SMALL
LARGE, SMALL = 0.05, 1e-5  # [-] below SMALL references have too few digits
BENDINGS = ("midedge", "midedge2")
QUICK = ("A1", "B2", "C1-90, beta 1")


class Asked(NamedTuple):
    """A result, the output whose error is estimated, the surface, and the exact output."""

    result: Any
    output: Callable[[Any], Any]
    project: Callable[[np.ndarray], np.ndarray] | None
    exact: float


def _bent_strip(cells: tuple[int, int], bending: str) -> Asked:
    mesh = shear_strip.strip(cells, bending)
    tip = mesh.vertices_at(x=shear_strip.LENGTH)
    rest = ms.equilibrium(shear_strip.scene(mesh, bending))
    return Asked(
        rest, lambda rest: rest.positions[tip, 2].mean(), None, float(shear_strip.stretched_end()[0])
    )


def _magnetized_strip(cells: tuple[int, int], bending: str, beta: float) -> Asked:
    size = magnetic_strip.LENGTH, magnetic_strip.WIDTH
    mesh = ms.meshes.rectangle(*size, cells, irregular=0.25, order=order_of(bending))
    tip = mesh.vertices_at(x=magnetic_strip.LENGTH)
    rest = ms.equilibrium(
        magnetic_strip.scene(mesh, bending), **magnetic_strip.load_parameters(beta, (0.0, 0.0, 1.0))
    )
    exact = float(magnetic_strip.stretched_end(beta)[1])
    return Asked(rest, lambda rest: rest.positions[tip, 2].mean() / magnetic_strip.LENGTH, None, exact)


def _roof(cells: tuple[int, int], bending: str) -> Asked:
    radius, angle = linear_cylinders.ROOF_RADIUS, linear_cylinders.ROOF_HALF_ANGLE
    middle = linear_cylinders.ROOF_LENGTH / 2
    mesh = ms.meshes.cylinder(radius, middle, (0.0, angle), cells=cells, order=order_of(bending))
    edge = mesh.nearest_vertex((radius * np.sin(angle), middle, radius * np.cos(angle)))
    response = linear_cylinders.roof_response(mesh, bending)
    # The limit of midedge2, on 48 x 48 and 64 x 64 elements.
    return Asked(response, lambda bent: -bent.displacements[edge, 2], _onto_cylinder(radius), 0.300592)


def _cylinder(cells: tuple[int, int], bending: str) -> Asked:
    radius, half = linear_cylinders.PINCHED_RADIUS, linear_cylinders.PINCHED_LENGTH / 2
    mesh = linear_cylinders.eighth(cells, None, order_of(bending))
    sheet = ms.Shell(mesh, thickness=3.0, young_modulus=3e6, poisson_ratio=0.3, bending=bending)
    supports = [ms.Pin(mesh.vertices_at(y=half), "xz"), *map(ms.SymmetryPlane, np.eye(3))]
    loaded = mesh.nearest_vertex((0, 0, radius))
    force = ms.PointLoad(loaded, (0, 0, -0.25))
    response = ms.linear_response(ms.Scene(sheet, supports=supports, loads=[force]))
    return Asked(response, lambda bent: -bent.displacements[loaded, 2], _onto_cylinder(radius), 1.82842e-5)


def _plate(cells: tuple[int, int], bending: str, support: str, load: str) -> Asked:
    mesh = plates.graded_quarter(cells, None)
    if bending == "midedge2":
        mesh = ms.QuadraticTriangleMesh.from_triangles(mesh)
    response = plates.quarter_response(mesh, bending, support, load)
    middle = mesh.nearest_vertex((0, 0, 0))
    return Asked(response, lambda bent: bent.displacements[middle, 2], None, plates.SQUARE[support, load])


def _hemisphere(cells: tuple[int, int], bending: str) -> Asked:
    mesh = hemisphere.quarter(cells, bending)
    rest = ms.equilibrium(hemisphere.scene(mesh, bending, force=400.0))
    pushed = mesh.nearest_vertex((0, hemisphere.RADIUS, 0))

    def onto(points: np.ndarray) -> np.ndarray:
        return hemisphere.RADIUS * points / np.linalg.norm(points, axis=1, keepdims=True)

    return Asked(rest, lambda rest: -rest.displacements[pushed, 1], onto, 8.1495)


def _onto_cylinder(radius: float) -> Callable[[np.ndarray], np.ndarray]:
    def onto(points: np.ndarray) -> np.ndarray:
        factors = radius / np.linalg.norm(points[:, [0, 2]], axis=1)
        return np.stack([factors * points[:, 0], points[:, 1], factors * points[:, 2]], axis=1)

    return onto


# {case: (what makes it, {bending: cells of its meshes})}; the names are those of the accuracy table
ESTIMATED: dict[str, tuple[Callable[..., Asked], tuple[Any, ...], dict[str, tuple[tuple[int, int], ...]]]] = {
    "A1": (_bent_strip, (), {"midedge": ((10, 2), (20, 2), (40, 4)), "midedge2": ((10, 2),)}),
    "A4": (_hemisphere, (), {"midedge": ((64, 16), (128, 32)), "midedge2": ((32, 8), (64, 16))}),
    "B1": (_roof, (), {"midedge": ((16, 16), (32, 32)), "midedge2": ((4, 4), (8, 8))}),
    "B2": (_cylinder, (), {"midedge": ((16, 16), (32, 32)), "midedge2": ((8, 8), (16, 16))}),
    **{
        f"B5 {support}, {load}": (
            _plate,
            (support, load),
            {"midedge": ((8, 8), (16, 16)), "midedge2": ((4, 4), (8, 8))},
        )
        for support, load in plates.SQUARE
    },
    "C1-90, beta 1": (_magnetized_strip, (1.0,), {"midedge": ((10, 2), (40, 4)), "midedge2": ((10, 2),)}),
    "C1-90, beta 20": (_magnetized_strip, (20.0,), {"midedge": ((10, 2), (40, 4)), "midedge2": ((10, 2),)}),
}


def measure(quick: bool = False) -> list[dict[str, Any]]:
    """Return the true error, the effectivity and the cost of the estimates of all cases, and print them.

    The error of A4 changes its sign near 64 x 16 midedge cells, and is smaller there than that of the six-node elements that
    estimate it.
    """
    rows = []
    for name, (make, arguments, meshes) in ESTIMATED.items():
        if quick and name not in QUICK:
            continue
        for bending in BENDINGS:
            for cells in meshes[bending][:1] if quick else meshes[bending]:
                rows.append(_estimated(name, make(cells, bending, *arguments), cells, bending))
    headings = ["case", "bending", "mesh", "error", "effectivity", "factorizations", "time over solve"]
    print_table("Estimated over true errors (ms.error_estimate)", headings, [_row(each) for each in rows])
    return rows


def _estimated(name: str, asked: Asked, cells: tuple[int, int], bending: str) -> dict[str, Any]:
    found = ms.error_estimate(asked.result, asked.output, project=asked.project)
    true = asked.exact - found.value
    return {
        "case": name,
        "bending": bending,
        "cells": list(cells),
        "error": true / asked.exact,
        "effectivity": found.error / true,
        "factorizations": found.factorizations,
        "of solve": asked.result.factorizations,
        "time": found.wall_time,
        "time of solve": asked.result.wall_time,
    }


def _row(of: dict[str, Any]) -> list[str]:
    counted = SMALL < abs(of["error"]) < LARGE
    title = f"{of['case']}, {of['bending']}, {of['cells'][0]}x{of['cells'][1]}: effectivity"
    missed = ""
    if counted:
        ratio = of["effectivity"]
        missed = note("error", title, max(ratio, 1.0 / ratio) if ratio > 0.0 else math.inf, at_most=MOST)
    return [
        of["case"],
        of["bending"],
        "x".join(map(str, of["cells"])),
        f"{100 * of['error']:+.3f} %",
        f"{of['effectivity']:.3f}{missed}",
        f"{of['factorizations']} ({of['of solve']} of the solve)",
        f"{of['time'] / of['time of solve']:.1f}",
    ]
