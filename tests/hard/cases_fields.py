"""Fields and weights a thousand times too strong for the sheet, from rest in one call."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, both, near
from registry import case
from sheets import (
    LENGTH,
    MAGNETIZATION,
    YOUNG_MODULUS,
    cantilever,
    end_position,
    field_for,
    graded,
    shell,
    strip,
)
from theory import along_a_strong_force, hanging, stretch

import magshell as ms

NARROW = 4e-4  # m: it bends at the clamp alone, and its cells must not be wider than the bend


def in_field(number: float, angle: float, rel: float, cells=(80, 2), ratio=1e-4, width=NARROW) -> Answer:
    """Compare the end of a strip in a field at this angle with the elastica, M B h w L^2 / (E I) = number."""
    mesh = graded(strip(cells, width=width))
    sheet = shell(mesh, thickness=ratio * LENGTH)  # the elastica does not stretch
    direction = np.array([np.cos(angle), 0.0, np.sin(angle)])
    found = ms.equilibrium(
        cantilever(sheet, field=ms.UniformField()),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=field_for(number, sheet, LENGTH) * direction,
    )
    got = end_position(mesh, found.positions) @ direction / LENGTH
    return both(near("end along B", got, along_a_strong_force(number, angle), rel=rel), at_rest(found))


@case("a field across of {:g} E I / (M h w L^2): it bends at the clamp alone", over=(1e3, 1e4))
def across(number):
    return in_field(number, np.pi / 2, 2e-3)


@case("a field obliquely from behind, 1e4 E I / (M h w L^2)")
def from_behind():
    return in_field(1e4, np.radians(150.0), 3e-3)


@case("a field a thousand times the one that buckles it, from behind: the flat strip is a saddle")
def against():
    return in_field(1e3 * np.pi**2 / 4.0, np.pi, 5e-3)


def guided(field_over_modulus: float, cells=(8, 2)) -> ms.Equilibrium:
    """Compute the equilibrium of a strip that can only change its length, in a field M B over E along it."""
    mesh = strip(cells)
    sheet = shell(mesh)
    vertices = np.arange(mesh.n_vertices)
    supports = [ms.Pin(vertices, "yz"), ms.Pin(mesh.vertices_at(x=0.0), "x")]
    return ms.equilibrium(
        ms.Scene(sheet, supports=supports, field=ms.UniformField()),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(field_over_modulus * YOUNG_MODULUS / MAGNETIZATION, 0, 0),
    )


@case("M B of {:g} E along a guided strip", over=(1.0, 100.0))
def pulled(strength):
    found = guided(strength)
    got = np.ptp(found.positions[:, 0]) / LENGTH
    return both(near("stretch", got, stretch(strength), rel=1e-9), at_rest(found))


@case("M B of 100 E against a guided strip: no length is left to it but that of the strip turned round")
def compressed():
    found = guided(-100.0)
    end = end_position(found.scene.mesh, found.positions)[0] / LENGTH
    return both(near("end x / L", end, -stretch(100.0), rel=1e-9), at_rest(found))


@case("a weight of {:g} E I / L^3: it hangs from its clamp", over=(1e2, 1e4))
def heavy_strip(number):
    return hanging_strip(number, rel=2e-3)


def hanging_strip(number: float, rel: float, cells=(80, 2), ratio=1e-4) -> Answer:
    """Compare the end of a strip whose weight is number E I / L^3 with the elastica."""
    mesh = graded(strip(cells, width=NARROW))
    sheet = shell(mesh, thickness=ratio * LENGTH, mass_density=1e3)
    weight = 1e3 * sheet.thickness[0]  # kg/m2
    gravity = number * YOUNG_MODULUS * sheet.thickness[0] ** 3 / 12.0 / LENGTH**3 / weight
    found = ms.equilibrium(cantilever(sheet, gravity=(0, 0, -gravity)))
    end = end_position(mesh, found.positions) / LENGTH
    expected = hanging(number)
    return both(near("end x, z", end[[0, 2]], expected, rel=rel, scale=1.0), at_rest(found))


@case("a strip on a dipole that pulls 1e3 times harder than it can bear, in a scene that keeps them apart")
def close_to_a_dipole():
    return above_a_guided_strip(0.02, 50.0)


def above_a_guided_strip(height: float, moment: float, cells=(20, 2)) -> Answer:
    """Check a strip pinned to a line below the dipole, which can only stretch; by symmetry its middle stays.

    height: of the dipole [m]. moment: of it [A m2].
    """
    mesh = strip(cells)
    sheet = shell(mesh)
    dipole = ms.Dipoles([[LENGTH / 2, 0.005, height]], [[0.0, 0.0, moment]])
    vertices = np.arange(mesh.n_vertices)
    supports = [ms.Pin(vertices, "yz"), ms.Pin(mesh.vertices_at(x=LENGTH / 2), "x")]
    scene = ms.Scene(sheet, supports=supports, field=dipole)
    found = ms.equilibrium(scene, remanent_magnetization=(0, 0, MAGNETIZATION))
    mirrored = LENGTH - found.positions[mesh_mirror(mesh), 0]
    return both(
        near("x of the mirrored vertices", mirrored, found.positions[:, 0], rel=1e-8, scale=LENGTH),
        at_rest(found),
    )


def mesh_mirror(mesh: ms.TriangleMesh) -> np.ndarray:
    """Return the vertex at (L - x, y) for each vertex at (x, y)."""
    return np.array([mesh.nearest_vertex((LENGTH - x, y, z)) for x, y, z in mesh.rest_positions])
