"""Cases of `python -m benchmarks accuracy` computed by NGSolve, on the same meshes: irregular ones share the corners."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import ngsolve as ng
import numpy as np

import magshell as ms

from ..cases import linear_cylinders, magnetic_strip, plates, shear_strip
from . import ngsolve_linear, ngsolve_strips
from .ngsolve_linear import Material
from .ngsolve_mesh import netgen_mesh, onto_cylinder

_MOST_LOADS = 16  # largest number of load steps, if Newton's method does not converge with fewer


class Found(NamedTuple):
    """One number that a case compares: its relative error, and the processor time [s] that it took."""

    error: float
    seconds: float


Run = Callable[[tuple[int, int], float | None, int], list[Found]]


def roof(cells: tuple[int, int], irregular: float | None, order: int) -> list[Found]:
    """Solve case B1, the Scordelis-Lo roof."""
    radius, half = linear_cylinders.ROOF_RADIUS, linear_cylinders.ROOF_HALF_ANGLE
    middle = linear_cylinders.ROOF_LENGTH / 2
    mesh = ms.meshes.cylinder(radius, middle, (0.0, half), cells=cells, irregular=irregular)
    solved = roof_on(mesh, order, onto=True)
    edge = mesh.nearest_vertex((radius * np.sin(half), middle, radius * np.cos(half)))
    return [Found(abs(-solved.displacements[edge, 2] / 0.3006 - 1.0), solved.seconds)]


def roof_on(
    mesh: ms.TriangleMesh | ms.QuadraticTriangleMesh, order: int, onto: bool
) -> ngsolve_linear.Solved:
    """Solve a quarter of B1. onto: whether flat elements are bent onto the cylinder."""
    middle = linear_cylinders.ROOF_LENGTH / 2
    names = {
        "diaphragm": lambda x: abs(x[1]) < 1e-9,
        "middle": lambda x: abs(x[1] - middle) < 1e-9,
        "crown": lambda x: abs(x[0]) < 1e-6,
        "free": lambda _: True,
    }
    other = netgen_mesh(mesh, names)
    if onto:
        onto_cylinder(other, linear_cylinders.ROOF_RADIUS, order)
    fixed = {"x": "diaphragm|crown", "y": "middle", "z": "diaphragm"}
    material = Material(0.25, 4.32e8, 0.0)

    def weight(v):
        return -90 * v[2] * ng.ds(bonus_intorder=4)

    return ngsolve_linear.shell(other, order, material, fixed, "crown|middle", weight)


def cylinder(cells: tuple[int, int], irregular: float | None, order: int) -> list[Found]:
    """Solve case B2, the pinched cylinder."""
    radius, end = linear_cylinders.PINCHED_RADIUS, linear_cylinders.PINCHED_LENGTH / 2
    mesh = linear_cylinders.eighth(cells, irregular, order=1)
    names = {
        "diaphragm": lambda x: abs(x[1] - end) < 1e-6,
        "middle": lambda x: abs(x[1]) < 1e-6,
        "crown": lambda x: abs(x[0]) < 1e-6,
        "side": lambda _: True,
    }
    other = netgen_mesh(mesh, names)
    onto_cylinder(other, radius, order)
    loaded = mesh.nearest_vertex((0, 0, radius))
    fixed = {"x": "diaphragm|crown", "y": "middle", "z": "diaphragm|side"}
    material = Material(3.0, 3e6, 0.3)
    solved = ngsolve_linear.shell(
        other, order, material, fixed, "crown|middle|side", {loaded: (0.0, 0.0, -0.25)}
    )
    return [Found(abs(-solved.displacements[loaded, 2] / 1.82842e-5 - 1.0), solved.seconds)]


def square_plate(cells: tuple[int, int], irregular: float | None, order: int) -> list[Found]:
    """Solve case B5, the square plate: four deflections, each with its own matrix."""
    mesh = plates.graded_quarter(cells, irregular)
    names = {"rim": lambda x: x[:2].max() > 0.5 - 1e-9, "symmetry": lambda _: True}
    other = netgen_mesh(mesh, names, dim=2)
    middle = mesh.nearest_vertex((0, 0, 0))
    loads = {"pressure": lambda v: v * ng.dx, "force": {middle: 0.25}}
    found = []
    for (support, load), reference in plates.SQUARE.items():
        clamped = "rim|symmetry" if support == "clamped" else "symmetry"
        solved = ngsolve_linear.plate(other, order, 1.0, plates.POISSON_RATIO, "rim", clamped, loads[load])
        found.append(Found(abs(solved.displacements[middle, 0] / reference - 1.0), solved.seconds))
    return found


def end_shear(cells: tuple[int, int], irregular: float | None, order: int) -> list[Found]:
    """Solve case A1, a strip under end shear, at its full load."""
    mesh = _strip(shear_strip, cells, irregular)
    material = Material(shear_strip.THICKNESS, shear_strip.YOUNG_MODULUS, 0.0)
    other = netgen_mesh(mesh, _ends(shear_strip.LENGTH))

    def pull(load_factor, u, _):
        return -load_factor * shear_strip.FULL_LOAD / shear_strip.WIDTH * u[2] * _right(other)

    u, seconds = _end(other, order, material, mesh, shear_strip.LENGTH, pull)
    shortening, deflection = shear_strip.ELASTICA[1.0]
    return [Found(max(abs(u[2] / deflection - 1.0), abs(-u[0] / shortening - 1.0)), seconds)]


def shear_by_a_field(cells: tuple[int, int], irregular: float | None, order: int) -> list[Found]:
    """Solve case C4, a strip that a field bends as end shear does."""
    mesh = _strip(shear_strip, cells, irregular)
    thickness, magnetization = shear_strip.THICKNESS, magnetic_strip.MAGNETIZATION
    flux_density = shear_strip.FULL_LOAD / (thickness * shear_strip.WIDTH * magnetization)
    material = Material(thickness, shear_strip.YOUNG_MODULUS, 0.0)
    other = netgen_mesh(mesh, _ends(shear_strip.LENGTH))
    load = _in_a_field(thickness, magnetization * flux_density)
    u, seconds = _end(other, order, material, mesh, shear_strip.LENGTH, load)
    shortening, deflection = shear_strip.ELASTICA[1.0]
    return [Found(max(abs(u[2] / deflection - 1.0), abs(-u[0] / shortening - 1.0)), seconds)]


def field_across(
    cells: tuple[int, int], irregular: float | None, order: int, beta: float = 20.0
) -> list[Found]:
    """Solve case C1-90, a magnetised strip in a field across it."""
    mesh = _strip(magnetic_strip, cells, irregular)
    length, thickness = magnetic_strip.LENGTH, magnetic_strip.THICKNESS
    material = Material(thickness, magnetic_strip.YOUNG_MODULUS, 0.0)
    load_parameters = magnetic_strip.load_parameters(beta, (0.0, 0.0, 1.0))
    density = magnetic_strip.MAGNETIZATION * load_parameters["applied_flux_density"][2]
    other = netgen_mesh(mesh, _ends(length))
    u, seconds = _end(other, order, material, mesh, length, _in_a_field(thickness, density))
    x, y = magnetic_strip.ACROSS[beta]
    return [Found(max(abs(1.0 + u[0] / length - x), abs(abs(u[2]) / length - y)), seconds)]


def _in_a_field(thickness: float, density: float) -> Callable[..., Any]:
    """Return the energy of a strip magnetised along x in a field along z; density: M B, J/m3."""

    def energy(load_factor, _, deformed):
        return -load_factor * thickness * density * deformed[2, 0] * ng.ds

    return energy


def _strip(case, cells, irregular) -> ms.TriangleMesh:
    return ms.meshes.rectangle(case.LENGTH, case.WIDTH, cells, irregular=irregular)


def _ends(length: float) -> dict[str, Any]:
    close = 1e-9 * length
    return {
        "left": lambda x: x[0] < close,
        "right": lambda x: x[0] > length - close,
        "free": lambda _: True,
    }


def _right(other: ng.Mesh):
    return ng.ds(definedon=other.BBoundaries("right"))


def _end(other, order: int, material, mesh, length: float, load) -> tuple[np.ndarray, float]:
    """Return the mean displacement (3,) of the end, and the seconds, with as few load steps as Newton's method needs."""
    for loads in _load_steps():
        try:
            solved = ngsolve_strips.strip(other, order, material, load, loads, tolerance=1e-8)
        except ngsolve_strips.DidNotConverge:
            continue
        return solved.displacements[mesh.vertices_at(x=length)].mean(axis=0), solved.seconds
    raise ngsolve_strips.DidNotConverge(f"in {_MOST_LOADS} load steps")


def _load_steps() -> Iterator[int]:
    """Yield numbers of load steps, each twice the one before."""
    loads = 1
    while loads <= _MOST_LOADS:
        yield loads
        loads *= 2


RUNS: dict[str, Run] = {
    "A1": end_shear,
    "C1-90": field_across,
    "C4": shear_by_a_field,
    "B1": roof,
    "B2": cylinder,
    "B5": square_plate,
}
