"""Cases whose equilibria take many factorizations, beside the counts that were measured.

python tests/hard/costs.py [WORDS ...] [--all]

The counts of `MEASURED` were taken before a redesign of statics that is to lower them. Cases marked slow take minutes, or
do not end; they run with --all, or where WORDS name them.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

import magshell as ms

# (factorizations, iterations) of all calls of a case, measured on 23 November 2026, and a remark.
MEASURED: dict[str, tuple[int, int, str]] = {
    "ventricle, 3x1 cells": (97, 95, "apex at -26.31 mm"),
    "ventricle in four calls, 3x1 cells": (80, 80, ""),
    "ventricle, 5x2 cells": (154, 155, "apex at -26.75 mm"),
    "ventricle, 9x3 cells": (56, 344, "19,299 unknowns; measured on 26 November 2026"),
    "ventricle in four calls, 5x2 cells": (846, 813, "300, 202, 177 and 167 of them"),
    "closed thick tube, 1x3x3 cells": (17, 24, "4 or 5 a pressure"),
    "arm of four chambers, 4x7x7 cells": (24, 37, ""),
    "arm of four chambers, 10x7x7 cells": (26, 38, "0.8 s a pressure"),
}


@dataclass(frozen=True)
class Cost:
    """A case that takes many factorizations. run: yields each equilibrium, with the text to print about it."""

    name: str
    run: Callable[[], Iterator[tuple[ms.Equilibrium, str]]]
    slow: bool = False


def ventricle(
    cells: tuple[int, int], *, full: float = 10e3, wall: float = 3e-3, **material: object
) -> tuple[ms.Scene, ms.Pressure, int]:
    """Return problem 2 of Land et al. (2015): a truncated ellipsoid of Guccione's material, `full` [Pa] on its inner side.

    cells: from the apex to the base, and through the wall, `wall` [m] thick. material: replaces its properties. Returns
    the scene, its pressure, and the vertex of the inner
    apex, which goes to z = -26.6 mm.
    """
    flat = ms.meshes.extruded(ms.meshes.disk(1.0, cells=cells[0]), 1.0, cells[1])
    a, b, depth = flat.rest_positions.T
    short, long = 7e-3 + wall * depth, 17e-3 + wall * depth
    polar = np.pi - np.hypot(a, b) * (np.pi - np.arccos(5e-3 / long))  # from the base's side
    around = np.arctan2(b, a)
    x = np.stack(
        [
            short * np.sin(polar) * np.cos(around),
            short * np.sin(polar) * np.sin(around),
            long * np.cos(polar),
        ],
        axis=1,
    )
    mesh = ms.TetMesh(x, _upright(x, flat.tetrahedra))
    properties: dict = {
        "stiffness": 10e3,
        "fibre_exponent": 1.0,
        "cross_fibre_exponent": 1.0,
        "fibre_shear_exponent": 1.0,
        "bulk_modulus": 1e6,
        "fibres": (1.0, 0.0, 0.0),
    } | material
    body = ms.Solid(mesh, material=ms.Guccione(**properties), element="quadratic")
    inner = _on(mesh, np.abs(depth) < 1e-9)
    pressure = ms.Pressure(full, faces=_split(inner, body.mesh.n_faces // mesh.n_faces))
    base = ms.Pin(np.flatnonzero(np.abs(body.mesh.rest_positions[:, 2] - 5e-3) < 1e-9))
    apex = int(np.flatnonzero((np.hypot(a, b) < 1e-9) & (depth < 1e-9))[0])
    return ms.Scene(body, supports=[base], loads=[pressure]), pressure, apex


def thick_tube(cells: tuple[int, int, int]) -> tuple[ms.Scene, ms.Pressure, ms.Pressure]:
    """Return an eighth of a closed tube of rubber, nu = 0.4999, free to extend.

    cells: through the wall, around, along. Returns the scene and its pressures: inside, and the pull of the ends on the wall
    per pascal of it.
    """
    inner, outer, length = 1.0, 1.5, 2.0
    sheet = ms.meshes.sector(inner, outer, (0.0, np.pi / 2), cells=cells[:2])
    mesh = ms.meshes.extruded(sheet, length, cells[2])
    x = mesh.rest_positions
    material = ms.NeoHookean("isochoric", young_modulus=1e6, poisson_ratio=0.4999)
    body = ms.Solid(mesh, material=material, element="quadratic")
    per_face = body.mesh.n_faces // mesh.n_faces
    inside = ms.Pressure(
        1.0, faces=_split(_on(mesh, np.abs(np.hypot(x[:, 0], x[:, 1]) - inner) < 1e-9), per_face)
    )
    end = ms.Pressure(-1.0, faces=_split(_on(mesh, np.abs(x[:, 2] - length) < 1e-9), per_face))
    planes = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    return ms.Scene(body, supports=planes, loads=[inside, end]), inside, end


def arm(cells: tuple[int, int, int]) -> tuple[ms.Scene, ms.Pressure]:
    """Return an arm of rubber with four chambers side by side, and the pressure in one of them.

    The walls between the chambers are one cell thick. cells: along, and 7 times 7 across for chambers of two.
    """
    size = np.array([0.15, 0.035, 0.035])
    block = ms.meshes.box(tuple(size), cells=cells)
    middles = block.rest_positions[block.tetrahedra].mean(axis=1) / size * cells
    cell = np.floor(middles).astype(int)
    hollow = (cell[:, 0] > 0) & (cell[:, 0] < cells[0] - 1) & (cell[:, 1:] % 3 != 0).all(axis=1)
    kept, numbered = np.unique(block.tetrahedra[~hollow], return_inverse=True)
    mesh = ms.TetMesh(block.rest_positions[kept], numbered.reshape(-1, 4))
    material = ms.NeoHookean(young_modulus=5e5, poisson_ratio=0.45)
    body = ms.Solid(mesh, material=material, element="quadratic")
    at = mesh.face_barycenters / size * cells
    inside = (at[:, 0] > 1 - 1e-6) & (at[:, 0] < cells[0] - 1 + 1e-6)
    inside &= ((at[:, 1:] > 1 - 1e-6) & (at[:, 1:] < 3 + 1e-6)).all(axis=1)
    pressure = ms.Pressure(1.0, faces=_split(np.flatnonzero(inside), body.mesh.n_faces // mesh.n_faces))
    held = ms.Pin(np.flatnonzero(np.abs(body.mesh.rest_positions[:, 0]) < 1e-9))
    return ms.Scene(body, supports=[held], loads=[pressure]), pressure


def _on(mesh: ms.TetMesh, vertices: np.ndarray) -> np.ndarray:
    """Return the faces all of whose corners are among these vertices, (n_v,) bool."""
    return np.flatnonzero(vertices[mesh.faces].all(axis=1))


def _split(faces: np.ndarray, parts: int) -> np.ndarray:
    """Return the flat triangles of these faces on a mesh of quadratic tetrahedra, `parts` per face."""
    return (parts * faces[:, None] + np.arange(parts)).ravel()


def _upright(x: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Return tetrahedra of positive volume: all are reversed if their volumes are negative."""
    edges = x[tetrahedra[:, 1:]] - x[tetrahedra[:, :1]]
    return tetrahedra if np.linalg.det(edges).sum() > 0.0 else tetrahedra[:, [0, 2, 1, 3]]


def _ventricle_at_once(cells):
    scene, _, apex = ventricle(cells)
    found = ms.equilibrium(scene)
    yield found, f"apex at {1e3 * found.positions[apex, 2]:.2f} mm"


def _ventricle_in_four(cells):
    scene, pressure, apex = ventricle(cells)
    found = None
    for each in (2.5e3, 5e3, 7.5e3, 10e3):
        found = ms.equilibrium(scene, values={pressure: {"pressure": each}}, start=found)
        yield found, f"{each:g} Pa, apex at {1e3 * found.positions[apex, 2]:.2f} mm"


def _tube(cells):
    scene, inside, end = thick_tube(cells)
    pull = 1.0 / (1.5**2 - 1.0)  # [-] over the pressure: pi r^2 over the area of the wall
    found = None
    for each in (0.25e5, 0.5e5, 0.75e5, 1e5):  # the limit is at 1.2e5: test_nonsymmetric_stability.py
        values = {inside: {"pressure": each}, end: {"pressure": -pull * each}}
        found = ms.equilibrium(scene, values=values, start=found)
        yield found, f"{each:g} Pa, length {found.positions[:, 2].max():.5f} m"


def _arm(cells):
    scene, pressure = arm(cells)
    found = None
    for each in np.arange(1, 9) * 5e3:
        found = ms.equilibrium(scene, values={pressure: {"pressure": each}}, start=found)
        yield found, f"{each:g} Pa, end at z = {1e3 * found.positions[:, 2].max():.2f} mm"


COSTS = [
    Cost("ventricle, 3x1 cells", lambda: _ventricle_at_once((3, 1))),
    Cost("ventricle in four calls, 3x1 cells", lambda: _ventricle_in_four((3, 1))),
    Cost("ventricle, 5x2 cells", lambda: _ventricle_at_once((5, 2)), slow=True),
    Cost("ventricle, 9x3 cells", lambda: _ventricle_at_once((9, 3)), slow=True),
    Cost("ventricle in four calls, 5x2 cells", lambda: _ventricle_in_four((5, 2)), slow=True),
    Cost("closed thick tube, 1x3x3 cells", lambda: _tube((1, 3, 3)), slow=True),
    Cost("arm of four chambers, 4x7x7 cells", lambda: _arm((4, 7, 7)), slow=True),
    Cost("arm of four chambers, 10x7x7 cells", lambda: _arm((10, 7, 7)), slow=True),
]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Equilibria that take many factorizations.")
    parser.add_argument("words", nargs="*", help="run only what has all of them in its name")
    parser.add_argument("--all", action="store_true", help="run the slow ones too")
    options = parser.parse_args(arguments)
    for each in COSTS:
        if not all(word in each.name for word in options.words):
            continue
        if each.slow and not (options.all or options.words):
            print(f"{each.name}: slow, left out")
            continue
        _print(each)
    return 0


def _print(each: Cost) -> None:
    began, factorizations, iterations = time.perf_counter(), 0, 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for found, told in each.run():
                factorizations += found.factorizations
                iterations += found.iterations
                took = time.perf_counter() - began
                print(
                    f"  {told}: {found.factorizations} factorizations, {took:.1f} s since the start",
                    flush=True,
                )
        except ms.NotConverged as error:
            factorizations += error.last_good.factorizations
            iterations += error.last_good.iterations
            print(f"  {error}")
    told = f"measured: {MEASURED[each.name]}" if each.name in MEASURED else "not measured"
    print(f"{each.name}: {factorizations} factorizations, {iterations} iterations; {told}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
