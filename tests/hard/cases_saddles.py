"""Symmetric unstable equilibria: a solve must leave them and end where theory says."""

from __future__ import annotations

import numpy as np
from answers import at_rest, below, both, holds, near
from registry import case
from sheets import LENGTH, MAGNETIZATION, cantilever, end_position, ends, field_for, shell, strip
from theory import buckle_height, elastica

import magshell as ms


def shortened(ratio: float, shortening: float, cells=(40, 2)) -> ms.Scene:
    """Return a scene of a strip of thickness over length `ratio`, clamped at both ends and shortened by a fraction."""
    mesh = strip(cells)
    near_end, far_end = ends(mesh)
    push = ms.Clamp(far_end, displacement=(-shortening * LENGTH, 0, 0))
    return ms.Scene(shell(mesh, thickness=ratio * LENGTH), supports=[ms.Clamp(near_end), push])


@case("pushed in its plane by a tenth of its length, thickness over length {:g}", over=(1e-2, 1e-3, 1e-4))
def flat_strip_between_clamps(ratio):
    """Shorten strips by 30, 3e3 and 3e5 times their critical shortening."""
    found = ms.equilibrium(shortened(ratio, 0.1))
    height = np.ptp(found.positions[:, 2])
    return both(near("height", height, LENGTH * buckle_height(0.1), rel=1e-2), at_rest(found))


@case("the saddle itself, asked for")
def flat_strip_left_alone():
    found = ms.equilibrium(shortened(1e-3, 1e-3), require_stable=False)
    flat = np.abs(found.positions[:, 2]).max() == 0.0
    return both(
        holds(
            "flat, and said to be unstable", flat and not found.stable and found.n_negative_eigenvalues > 0
        ),
        below("residual", found.residual, 1e-10),
    )


@case("an opposed field, {} times the one that buckles it", over=(1.02, 4.0, 40.0))
def strip_magnetized_against_the_field(factor):
    mesh = strip((80, 2), width=2e-3)
    sheet = shell(mesh, thickness=1e-3 * LENGTH)
    number = factor * np.pi**2 / 4.0
    found = ms.equilibrium(
        cantilever(sheet, field=ms.UniformField()),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(-field_for(number, sheet, LENGTH), 0, 0),
    )
    end = end_position(mesh, found.positions) / LENGTH
    got = (end[0], abs(end[2]))
    # Close to the critical load the height grows with the square root of the excess load.
    return both(near("end x, z", got, elastica(number, np.pi), rel=4e-3, scale=1.0), at_rest(found))


@case("a hinged magnet with its back to the field: rigid, and exactly in balance")
def compass_needle_upside_down():
    mesh = strip((4, 2))
    sheet = shell(mesh, thickness=1e-2 * LENGTH)
    axis = ms.Pin(mesh.vertices_at(x=0.0))
    scene = ms.Scene(sheet, supports=[axis], field=ms.UniformField(), allow_rigid_motions=True)
    strength = 1e-3  # T: enough to rotate it, far too little to bend it
    found = ms.equilibrium(
        scene, remanent_magnetization=(MAGNETIZATION, 0, 0), applied_flux_density=(-strength, 0, 0)
    )
    expected = -MAGNETIZATION * strength * sheet.face_volumes.sum()
    return both(
        near("energy", found.energy, expected, rel=1e-3),
        near("end x", end_position(mesh, found.positions)[0], -LENGTH, rel=1e-3),
        at_rest(found),
    )


@case("a square pushed alike from all four sides, 20 times as far as where it buckles")
def plate_with_double_modes():
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(12, 12), diagonals="crossed")
    sheet = shell(mesh, thickness=1e-2, poisson_ratio=0.3)
    push = 20.0 * np.pi**2 * 1e-4 / (6.0 * (1.0 + 0.3))  # twice the strain at which it buckles, 20 times
    corner = [mesh.nearest_vertex((1, 1, 0))]
    right, top = (np.setdiff1d(side, corner) for side in (mesh.vertices_at(x=1.0), mesh.vertices_at(y=1.0)))
    supports = [
        ms.Pin(mesh.vertices_at(x=0.0), "x"),
        ms.Pin(mesh.vertices_at(y=0.0), "y"),
        ms.Pin(right, "x", displacement=(-push, 0, 0)),
        ms.Pin(top, "y", displacement=(0, -push, 0)),
        ms.Pin(corner, "xy", displacement=(-push, -push, 0)),
        ms.Pin(mesh.boundary_vertices, "z"),
    ]
    scene = ms.Scene(sheet, supports=supports)
    flat = ms.equilibrium(scene, require_stable=False)
    found = ms.equilibrium(scene)
    return both(
        holds("the flat state is a saddle", flat.n_negative_eigenvalues > 1),
        below("energy over that of the flat state", found.energy / flat.energy, 0.5),
        at_rest(found),
    )


@case("a perfect tube pushed along its axis to twice where it buckles: many modes at once")
def tube_in_compression():
    radius, length, thickness = 1.0, 0.6, 0.04
    mesh = ms.meshes.cylinder(radius, length, cells=(32, 10))
    sheet = shell(mesh, thickness=thickness, poisson_ratio=0.3)
    strain = thickness / (radius * np.sqrt(3.0 * (1.0 - 0.3**2)))
    push = ms.Pin(mesh.vertices_at(y=length), displacement=(0, -2.0 * strain * length, 0))
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(y=0.0)), push])
    straight = ms.equilibrium(scene, require_stable=False)
    found = ms.equilibrium(scene)
    return both(
        holds("the straight state is a saddle", straight.n_negative_eigenvalues > 1),
        below("energy over that of the straight state", found.energy / straight.energy, 0.9),
        at_rest(found),
    )
