"""Solids against exact and published numbers, with linear and quadratic tetrahedra.

T4a Cook's membrane, T5 and T6 a beam with large deflection, T11a the modes of a free cube, M1 a beam bent by a
field, M3a by the field on its skins, T7a one of silicone under its weight. M2 and I1 hold to round-off with both
elements: tests/physics/test_skin_cases.py, tests/physics/test_solid_validation.py.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import magshell as ms

from .outcome import Comparison

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

ELEMENTS = ("linear", "quadratic")


class SolidOutcome(NamedTuple):
    """The result of one run: time [s] of the processor, of all solves together; iterations is None if there are none."""

    mesh: str
    tetrahedra: int
    unknowns: int
    iterations: int | None
    time: float
    comparisons: tuple[Comparison, ...]


class SolidCase(NamedTuple):
    """A case for solids. run(cells, element) -> SolidOutcome; cells: of each element's mesh, with about equal numbers
    of unknowns; coarse: for a quick look.

    The errors that a quadratic mesh must stay below are in its comparisons; a linear mesh is for information only.
    """

    name: str
    title: str
    run: Callable[[tuple[int, int, int], str], SolidOutcome]
    cells: dict[str, tuple[int, int, int]]
    coarse: tuple[int, int, int]


def at(solid: ms.Solid, **where: float) -> np.ndarray:
    x = solid.mesh.rest_positions
    tiny = 1e-9 * np.ptp(x)
    on = [np.abs(x[:, "xyz".index(axis)] - value) < tiny for axis, value in where.items()]
    return np.flatnonzero(np.all(on, axis=0))


def pulled_end(solid: ms.Solid, axis_value: float, force: ArrayLike) -> ms.PointLoad:
    """Return a force [N] spread evenly over the plane face at x = axis_value.

    The nodal forces are integrals of the shape functions: at the corners of linear triangles, at the edge middles
    of quadratic ones.
    """
    end = np.zeros(len(solid.mesh.rest_positions), dtype=bool)
    end[at(solid, x=axis_value)] = True
    weights, x = np.zeros(len(end)), solid.mesh.rest_positions
    middles = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}
    for corners in ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)):
        faces = solid.mesh.tetrahedra[end[solid.mesh.tetrahedra[:, corners]].all(axis=1)]
        a, b, c = (x[faces[:, corner]] for corner in corners)
        areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        edges = [(corners[i], corners[j]) for i, j in ((0, 1), (1, 2), (0, 2))]
        for local in corners if solid.element == "linear" else [middles[edge] for edge in edges]:
            np.add.at(weights, faces[:, local], areas / 3.0)
    vertices = np.flatnonzero(weights)
    return ms.PointLoad(vertices, weights[vertices, None] / weights.sum() * np.asarray(force, dtype=float))


def solved(scene: ms.Scene, **load_parameters: Any) -> tuple[ms.Equilibrium, float]:
    began = time.process_time()
    found = ms.equilibrium(scene, **load_parameters)
    return found, time.process_time() - began


def outcome(
    cells: Sequence[int], scene: ms.Scene, comparisons: Iterable[Comparison], iterations: int, seconds: float
) -> SolidOutcome:
    name = "x".join(str(count) for count in cells)
    tetrahedra = scene.bodies[0].mesh.n_tetrahedra
    return SolidOutcome(name, tetrahedra, scene.n_dofs, iterations, seconds, tuple(comparisons))


def asked(element: str, allowed: float) -> float | None:
    return allowed if element == "quadratic" else None


# u_y of the corner [mm], by Taylor-Hood elements of order 6 with refined corners.
COOK = {0.45: 7.23204151, 0.499: 6.940766625}


def cook(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    """Compute Cook's membrane in plane strain, in mm and MPa."""
    unit = ms.meshes.box((1, 1, 1), cells=cells)
    x, y, z = unit.rest_positions.T
    mesh = ms.TetMesh(np.stack([48 * x, 44 * x + y * (44 - 28 * x), z], axis=1), unit.tetrahedra)
    found, comparisons = [], []
    for poisson_ratio, reference in COOK.items():
        material = ms.NeoHookean("isochoric", young_modulus=240.565, poisson_ratio=poisson_ratio)
        solid = ms.Solid(mesh, material=material, element=element)
        root = at(solid, x=0.0)
        flat = np.setdiff1d(np.union1d(at(solid, z=0.0), at(solid, z=1.0)), root)
        supports = [ms.Pin(root), ms.Pin(flat, components="z")]
        scene = ms.Scene(solid, supports=supports, loads=[pulled_end(solid, 48.0, (0, 100.0, 0))])
        found.append(solved(scene))
        corner = found[-1][0].displacements[at(solid, x=48.0, y=60.0, z=0.0)[0], 1]
        name = f"u_y, nu = {poisson_ratio}"
        comparisons.append(Comparison(name, corner, reference, allowed=asked(element, 0.01)))
    iterations = max(rest.iterations for rest, _ in found)
    return outcome(cells, scene, comparisons, iterations, sum(seconds for _, seconds in found))


# Deflection and shortening of a beam of 10 x 1 x 1 with P L^2 / EI = 2, by Taylor-Hood elements of order 4.
BEAM = {0.45: (4.92402056, 1.581861219), 0.499: (4.905444568, 1.571701279)}
BEAM_MODULUS, BEAM_FORCE = 1e5, 2e5 / 1200


def bent_beam(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    """Compute a beam bent by a dead force on its end."""
    return _bent(
        cells, element, BEAM, lambda solid: {"loads": [pulled_end(solid, 10.0, (0, 0, BEAM_FORCE))]}, {}
    )


def magnetic_beam(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    """Compute the beam bent by a field across its magnetization, which is equivalent to the same force on its end."""
    flux = 0.1
    magnetization = (BEAM_FORCE / flux, 0.0, 0.0)
    return _bent(
        cells,
        element,
        {0.45: BEAM[0.45]},
        lambda solid: {"field": ms.UniformField()},
        {"applied_flux_density": (0, 0, flux)},
        remanent_magnetization=magnetization,
    )


def _bent(cells, element, references, acting, load_parameters, **properties) -> SolidOutcome:
    found, comparisons = [], []
    for poisson_ratio, (deflection, shortening) in references.items():
        material = ms.NeoHookean("isochoric", young_modulus=BEAM_MODULUS, poisson_ratio=poisson_ratio)
        mesh = ms.meshes.box((10, 1, 1), cells=cells, diagonals="crossed")
        solid = ms.Solid(mesh, material=material, element=element, **properties)
        scene = ms.Scene(solid, supports=[ms.Pin(at(solid, x=0.0))], **acting(solid))
        found.append(solved(scene, **load_parameters))
        end = at(solid, x=10.0)
        middle = end[np.argmin(np.linalg.norm(solid.mesh.rest_positions[end] - [10.0, 0.5, 0.5], axis=1))]
        moved = found[-1][0].displacements[middle]
        of = f", nu = {poisson_ratio}"
        comparisons.append(Comparison(f"w{of}", moved[2], deflection, allowed=asked(element, 0.005)))
        comparisons.append(Comparison(f"u{of}", -moved[0], shortening, allowed=asked(element, 0.005)))
    iterations = max(rest.iterations for rest, _ in found)
    return outcome(cells, scene, comparisons, iterations, sum(seconds for _, seconds in found))


# Circular frequencies 1 to 12 of a cube with E = 1, density 1, side 1, by Ritz's method of order 6.
CUBE = {
    0.3: [1.77125] * 2 + [2.38517] * 3 + [2.42566] * 3 + [2.75536] * 3 + [2.83592],
    0.45: [1.67747] * 2 + [2.27819] * 3 + [2.30233] * 3 + [2.60895] * 3 + [2.89989],
}


def free_cube(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    """Compute the vibration modes of a free cube, with lumped masses, whose error is of second order."""
    comparisons, seconds = [], 0.0
    for poisson_ratio, reference in CUBE.items():
        material = ms.NeoHookean(young_modulus=1.0, poisson_ratio=poisson_ratio)
        solid = ms.Solid(
            ms.meshes.box((1, 1, 1), cells=cells), material=material, mass_density=1.0, element=element
        )
        scene = ms.Scene(solid, allow_rigid_motions=True)
        began = time.process_time()
        modes = ms.vibration_modes(scene, count=18)
        seconds += time.process_time() - began
        found = 2 * np.pi * np.sort(modes.frequencies)[6:]
        names = [f"mode {k + 1}" for k in range(12)]
        allowed = asked(element, 0.01)
        comparisons.append(
            Comparison(f"omega, nu = {poisson_ratio}", found, reference, at=names, allowed=allowed)
        )
    return outcome(cells, scene, comparisons, None, seconds)


# Tip of a beam with opposite skins: g: (x, y) over its length.
SKINS = {0.5: (0.9665630825, 0.2213158696), 2.0: (0.8323702576, 0.4709996116)}


def skinned_beam(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    """Compute a beam with skins magnetized along and against it, in a field along it: its curvature is constant."""
    length, side, modulus, thickness, flux = 0.1, 0.01, 1e5, 1e-4, 0.02
    found, comparisons = [], []
    for g, end in SKINS.items():
        mesh = ms.meshes.box((length, side, side), cells=cells)
        sides = mesh.faces_at(z=side), mesh.faces_at(z=0.0)
        strength = g * modulus * side**3 / 12 / (flux * side * length * thickness)
        along = np.concatenate(
            [np.full(len(faces), sign) for faces, sign in zip(sides, (1, -1), strict=True)]
        )
        magnetization = strength * along[:, None] * np.array([1.0, 0, 0])
        skin = ms.Skin(thickness=thickness, faces=np.concatenate(sides), remanent_magnetization=magnetization)
        material = ms.NeoHookean(young_modulus=modulus, poisson_ratio=0.0)
        solid = ms.Solid(mesh, material=material, element=element, skin=skin)
        scene = ms.Scene(solid, supports=[ms.Pin(at(solid, x=0.0))], field=ms.UniformField())
        found.append(solved(scene, applied_flux_density=(flux, 0, 0)))
        x = solid.mesh.rest_positions
        tip = np.argmin(np.linalg.norm(x - [length, side / 2, side / 2], axis=1))
        moved = (found[-1][0].positions[tip] - [0, 0, x[tip, 2]]) / length
        computed = [moved[0], abs(moved[2])]
        comparisons.append(
            Comparison(f"tip, g = {g}", computed, end, at=("x", "y"), scale=1.0, allowed=asked(element, 0.02))
        )
    iterations = max(rest.iterations for rest, _ in found)
    return outcome(cells, scene, comparisons, iterations, sum(seconds for _, seconds in found))


# A cantilever of silicone, z up. {force [N] on the tip's upper edge: dz of a marker [mm]}, by Taylor-Hood elements of
# order 3. The position of the marker was not published: here it is the middle of the tip, for information only.
SILICONE = {0.0: -6.769326202, 1.00062: -26.51584384}


def silicone(cells: tuple[int, int, int], element: str) -> SolidOutcome:
    found, comparisons = [], []
    material = ms.NeoHookean("isochoric", young_modulus=263824.0, poisson_ratio=0.499)
    mesh = ms.meshes.box((0.1, 0.03, 0.03), cells=cells)
    for weight, reference in SILICONE.items():
        solid = ms.Solid(mesh, material=material, mass_density=1070.0, element=element)
        edge, tip = at(solid, x=0.1, z=0.03), at(solid, x=0.1)
        loads = [ms.PointLoad(edge, (0.0, 0.0, -weight / len(edge)))] if weight else []
        supports = [ms.Pin(at(solid, x=0.0))]
        scene = ms.Scene(solid, supports=supports, loads=loads, gravity=(0, 0, -9.807))
        found.append(solved(scene))
        offsets = solid.mesh.rest_positions[tip, 1:] - 0.015
        plane = np.column_stack([np.ones(len(tip)), offsets])
        dz = np.linalg.lstsq(plane, found[-1][0].displacements[tip, 2], rcond=None)[0][0]
        comparisons.append(Comparison(f"dz [mm], {weight:g} N", 1e3 * dz, reference))
    iterations = max(rest.iterations for rest, _ in found)
    return outcome(cells, scene, comparisons, iterations, sum(seconds for _, seconds in found))


BEAMS = {"linear": (24, 6, 6), "quadratic": (12, 3, 3)}
SOLID_CASES = (
    SolidCase("T4a", "Cook's membrane", cook, {"linear": (22, 22, 1), "quadratic": (8, 8, 1)}, (4, 4, 1)),
    SolidCase("T6", "beam, end force", bent_beam, BEAMS, (5, 2, 2)),
    SolidCase("T11a", "free cube", free_cube, {"linear": (12, 12, 12), "quadratic": (6, 6, 6)}, (3, 3, 3)),
    SolidCase("M1", "beam in a field", magnetic_beam, BEAMS, (5, 2, 2)),
    SolidCase(
        "M3a", "beam with skins", skinned_beam, {"linear": (40, 4, 4), "quadratic": (20, 2, 2)}, (10, 2, 2)
    ),
    SolidCase(
        "T7a", "silicone cantilever", silicone, {"linear": (20, 6, 6), "quadratic": (10, 3, 3)}, (4, 2, 2)
    ),
)
