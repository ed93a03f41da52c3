"""Cases whose counts are kept: every family of effort.py, motions, contact and projective iterations."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import effort
import numpy as np

import magshell as ms
from benchmarks import motion_costs, projective_motions, surrounding_costs, thrown_bars
from benchmarks.statics import strongly_bent

Counted = tuple[str, str, Callable[[], object]]  # family, case, the call to be counted

INTEGRATORS = (ms.ImplicitEuler(), ms.TRBDF2(), ms.SDIRK2(), ms.SDIRK3())


def all_families() -> Iterator[Counted]:
    """Yield family, case and call of all that is counted."""
    for faces in (512, 2048, 8192):
        yield "strongly bent", f"{faces} faces", lambda n=faces: _solved(*strongly_bent(n))
    for name, run in effort._all():
        if _is_counted(name):
            family, _, case = name.partition("/")
            yield family, case, run
    yield from _soft_solids()
    yield from _motions()
    yield from _projective()


def _is_counted(name: str) -> bool:
    """Return whether a case of effort.py is small enough for everyday runs."""
    parts = name.split("/")
    if parts[0] == "C1":
        return (parts[2] == "10x1" and parts[3] in ("2", "10", "50")) or parts[1:] == ["150", "40x4", "10"]
    if parts[0].startswith("A8"):
        return parts[1] == "8x8" or parts[1:] in (["12x12", "2000"], ["12x12", "-1000"])
    if parts[0] == "A6":
        return parts[1] == "8x8"
    if parts[0] == "rolled":
        return (parts[2] == "25x1" and parts[3] in ("1e-05", "0.001")) or parts[2:] == ["40x2", "0.01"]
    return name not in COSTLY


# Cases that take seconds each, or (scaling) repeat their solve for a given time.
COSTLY = {
    "hard solids/scaling",
    "hard contact/slope in steps, 1e-05",
    "hard contact/dropped, 10",
    "hard time steps/weak jumps",
    "hard cavities/filled, 30",
    "hard fields/against",
    "hard large rotations/twisted and back",
    "hard saddles/flat strip between clamps, 0.001",
    "hard saddles/flat strip between clamps, 0.0001",
    "hard saddles/strip magnetized against the field, 40",
    "hard slivers/far bent strip with a tiny face, 1e-05",
    "hard slivers/far bent strip with a face of nanometres",
    "hard solids/comes back, random, Corotated",
    "hard solids/crumples",
    "hard starts/folded",
    "hard starts/inverted",
    "hard starts/upside down",
    "hard starts/half size",
    "hard starts/rolled",
    "hard starts/random positions",
    "hard starts/squeezed",
}


def _solved(scene: ms.Scene, controls: dict | None = None) -> ms.Equilibrium:
    return ms.equilibrium(scene, **(controls or {}))


def ventricle(cells: int, layers: int) -> ms.Scene:
    """Return a quarter of the truncated ventricle of Land et al. 2015, problem 2, its base held, 10 kPa inside."""
    unit = ms.meshes.box((1.0, 1.0, 1.0), cells=(cells, cells, layers))
    a, b, depth = unit.rest_positions.T  # a square that becomes a quarter of a disc
    a, b = a * np.sqrt(1.0 - b**2 / 2.0), b * np.sqrt(1.0 - a**2 / 2.0)
    radius, around = np.hypot(a, b), np.arctan2(b, a)
    short, long = 7e-3 + 3e-3 * depth, 17e-3 + 3e-3 * depth  # m, half axes of the shells
    down = -np.pi + radius * (np.pi - np.arccos(5e-3 / long))
    aside = -short * np.sin(down)
    x = np.stack([aside * np.cos(around), aside * np.sin(around), long * np.cos(down)], axis=1)
    mesh = ms.TetMesh(x, unit.tetrahedra[:, [0, 2, 1, 3]])
    material = ms.Guccione(
        stiffness=10e3,
        fibre_exponent=1.0,
        cross_fibre_exponent=1.0,
        fibre_shear_exponent=1.0,
        bulk_modulus=1e7,
        fibres=(0.0, 0.0, 1.0),
    )
    solid = ms.Solid(mesh, material=material)
    base = np.flatnonzero(np.abs(solid.mesh.rest_positions[:, 2] - 5e-3) < 1e-9)
    inside = ms.Pressure(10e3, faces=unit.faces_at(z=0.0))
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
    solid = ms.Solid(
        ms.TetMesh(x, unit.tetrahedra), material=ms.NeoHookean(young_modulus=1e5, poisson_ratio=0.4999)
    )
    ends = (
        pressure * inner**2 / (outer**2 - inner**2)
    )  # axial traction [Pa] that rigid end caps transmit to the wall
    loads = [
        ms.Pressure(pressure, faces=unit.faces_at(x=0.0)),
        ms.Pressure(-ends, faces=unit.faces_at(z=1.0)),
    ]
    return ms.Scene(solid, supports=[ms.SymmetryPlane(normal) for normal in np.eye(3)], loads=loads)


def _soft_solids() -> Iterator[Counted]:
    for cells, layers in ((2, 1), (4, 1)):
        yield "ventricle", f"{cells}x{layers} cells", lambda c=cells, n=layers: _solved(ventricle(c, n))
    for pressure in (3e3, 6e3, 9e3):
        yield "thick tube", f"{pressure:g} Pa", lambda p=pressure: _solved(thick_tube(p))


def _motions() -> Iterator[Counted]:
    """Yield motions of sheets in a field, onto a floor and of bars that collide."""
    for method in INTEGRATORS:
        name = type(method).__name__
        sheet = motion_costs.strip((24, 4))
        yield "motions", name, lambda m=method, s=sheet: motion_costs.drive(s, 30, integrator=m)
    for name, each in surrounding_costs.SURROUNDINGS.items():
        yield (
            "surroundings",
            name,
            lambda e=each: surrounding_costs._motion(surrounding_costs.falling((12, 3), *e), 40, 1),
        )
    for touching in (True, False):
        yield (
            "thrown bars",
            "touching" if touching else "free",
            lambda t=touching: thrown_bars.thrown(thrown_bars.bars((6, 3, 1), t), 8),
        )


def _projective() -> Iterator[Counted]:
    """Yield falling beams whose rounds of Projective Dynamics are counted, to a residual of 1e-6."""
    for name, history in projective_motions.HISTORIES.items():
        method = ms.ProjectiveDynamics(tolerance=1e-6, history=history)
        scene = projective_motions.beam(projective_motions.MATERIALS["Projective"], (12, 3, 3))
        yield "projective", name, lambda m=method, s=scene: projective_motions._drive(s, m, 4)
