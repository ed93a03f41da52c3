"""Symmetric unstable equilibria: a solve must leave them and end where theory says."""

from __future__ import annotations

import numpy as np
from answers import Answer, at_rest, below, both, holds, near
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
    # Close to the critical load the height grows with the square root of the excess load.
    return against_the_field(factor, rel=4e-3)


def against_the_field(factor: float, cells=(80, 2), *, ratio: float = 1e-3, rel: float) -> Answer:
    """Compare the end of a strip in an opposed field, `factor` times the critical one, with the elastica."""
    mesh = strip(cells, width=2e-3)
    sheet = shell(mesh, thickness=ratio * LENGTH)
    number = factor * np.pi**2 / 4.0
    found = ms.equilibrium(
        cantilever(sheet, field=ms.UniformField()),
        remanent_magnetization=(MAGNETIZATION, 0, 0),
        applied_flux_density=(-field_for(number, sheet, LENGTH), 0, 0),
    )
    end = end_position(mesh, found.positions) / LENGTH
    got = (end[0], abs(end[2]))
    return both(near("end x, z", got, elastica(number, np.pi), rel=rel, scale=1.0), at_rest(found))


@case("a hinged magnet with its back to the field: rigid, and exactly in balance")
def compass_needle_upside_down():
    # Enough to rotate it, far too little to bend it.
    return needle(1e-3, (4, 2), 1e-2)


def needle(strength: float, cells: tuple[int, int], ratio: float) -> Answer:
    """Check that a hinged magnet, its back to a field of this strength [T], turns round."""
    mesh = strip(cells)
    sheet = shell(mesh, thickness=ratio * LENGTH)
    axis = ms.Pin(mesh.vertices_at(x=0.0))
    scene = ms.Scene(sheet, supports=[axis], field=ms.UniformField(), allow_rigid_motions=True)
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
    return compressed_plate(20.0, at_most=0.5)


def compressed_plate(
    times: float, cells: int = 12, *, width=1.0, thickness=1e-2, nu=0.3, at_most: float
) -> Answer:
    """Check a plate 1 long, pushed alike from four sides, `times` as far as where a square one buckles."""
    mesh = ms.meshes.rectangle(1.0, width, cells=(cells, cells), diagonals="crossed")
    sheet = shell(mesh, thickness=thickness, poisson_ratio=nu)
    push = times * np.pi**2 * thickness**2 / (6.0 * (1.0 + nu))  # a square one buckles at a strain of 1/times
    corner = [mesh.nearest_vertex((1, width, 0))]
    right, top = (np.setdiff1d(side, corner) for side in (mesh.vertices_at(x=1.0), mesh.vertices_at(y=width)))
    supports = [
        ms.Pin(mesh.vertices_at(x=0.0), "x"),
        ms.Pin(mesh.vertices_at(y=0.0), "y"),
        ms.Pin(right, "x", displacement=(-push, 0, 0)),
        ms.Pin(top, "y", displacement=(0, -push * width, 0)),
        ms.Pin(corner, "xy", displacement=(-push, -push * width, 0)),
        ms.Pin(mesh.boundary_vertices, "z"),
    ]
    scene = ms.Scene(sheet, supports=supports)
    flat = ms.equilibrium(scene, require_stable=False)
    found = ms.equilibrium(scene)
    return both(
        holds("the flat state is a saddle", flat.n_negative_eigenvalues > 1),
        below("energy over that of the flat state", found.energy / flat.energy, at_most),
        at_rest(found),
    )


def compressed_tube(
    times: float, cells=(32, 10), *, length=0.6, thickness=0.04
) -> tuple[ms.Equilibrium, ms.Equilibrium]:
    """Solve for a tube of radius 1 pushed along its axis to `times` where it buckles: any equilibrium, then a stable one."""
    radius = 1.0
    mesh = ms.meshes.cylinder(radius, length, cells=cells)
    sheet = shell(mesh, thickness=thickness, poisson_ratio=0.3)
    strain = thickness / (radius * np.sqrt(3.0 * (1.0 - 0.3**2)))
    push = ms.Pin(mesh.vertices_at(y=length), displacement=(0, -times * strain * length, 0))
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(y=0.0)), push])
    return ms.equilibrium(scene, require_stable=False), ms.equilibrium(scene)


@case("a perfect tube pushed along its axis to twice where it buckles: many modes at once")
def tube_in_compression():
    straight, found = compressed_tube(2.0)
    return both(
        holds("the straight state is a saddle", straight.n_negative_eigenvalues > 1),
        below("energy over that of the straight state", found.energy / straight.energy, 0.9),
        at_rest(found),
    )
