"""Creases beyond 170 and 180 degrees, twists by full circles, hairpins of few faces."""

from __future__ import annotations

import numpy as np
from answers import at_rest, below, both, near
from registry import case
from sheets import LENGTH, ends, shell, strip

import magshell as ms

ANGLES = (170, 179.99, 190, 350)


def two_squares(bending: str) -> ms.Scene:
    """Return a scene of two squares joined at x = 1; the second rotates about their common edge.

    The support factor is its angle in degrees.
    """
    mesh = ms.meshes.rectangle(2.0, 1.0, cells=(2, 1))
    sheet = shell(mesh, thickness=1e-2, bending=bending)
    fixed = mesh.vertices_where(lambda x: x[:, 0] < 1.5)
    turned = ms.Pin(mesh.vertices_at(x=2.0), rotation=(0, np.radians(-1.0), 0), center=(1.0, 0, 0))
    return ms.Scene(sheet, supports=[ms.Pin(fixed), turned])


@case("one crease of {} degrees (midedge)", over=ANGLES)
def crease_of_directors(degrees):
    return crease("midedge", degrees)


@case("one crease of {} degrees (hinge)", over=ANGLES)
def crease_of_hinges(degrees):
    return crease("hinge", degrees)


def crease(bending: str, degrees: float):
    """Check that the energy of a crease is proportional to the square of its angle.

    Beyond 180 degrees the halves would have passed through each other; positions are then those of a crease to the other
    side: 190 degrees are -170.
    """
    scene = two_squares(bending)
    one_degree = ms.equilibrium(scene).energies["bending"]
    found = ms.equilibrium(scene, support_factor=degrees)
    angle = min(degrees, 360.0 - degrees)
    return near("energy of the crease", found.energies["bending"], angle**2 * one_degree, rel=1e-6)


@case("twisted by two full turns and back")
def twisted_and_back():
    """Check that a twist by two full circles and back leaves no rotation behind."""
    mesh = strip((40, 2))
    near_end, far_end = ends(mesh)
    sheet = shell(mesh, thickness=1e-4)
    twist = ms.Clamp(far_end, rotation=(4.0 * np.pi, 0, 0))
    scene = ms.Scene(sheet, supports=[ms.Clamp(near_end), twist])
    there = ms.equilibrium(scene)
    back = ms.equilibrium(scene, support_factor=0.0, start=there)
    return both(
        below("energy left", back.energy / there.energy, 1e-12),
        near("positions", back.positions, mesh.rest_positions, rel=1e-7, scale=LENGTH),
        at_rest(back),
    )


@case("a strip of four cells bent into a U by its ends: folds of 45 degrees and more")
def coarse_hairpin():
    """Equal and opposite turns of the ends leave the sheet symmetric, however coarse it is."""
    mesh = strip((4, 1))
    near_end, far_end = ends(mesh)
    sheet = shell(mesh, thickness=1e-3)
    supports = [
        ms.Clamp(near_end, rotation=(0, -np.pi / 2, 0)),
        ms.Clamp(far_end, rotation=(0, np.pi / 2, 0), displacement=(-0.4 * LENGTH, 0, 0)),
    ]
    found = ms.equilibrium(ms.Scene(sheet, supports=supports))
    x, y, z = found.positions.T
    mirrored = np.stack([0.6 * LENGTH - x, y, z], axis=1)
    partner = [mesh.nearest_vertex((LENGTH - a, b, c)) for a, b, c in mesh.rest_positions]
    return both(
        near("mirror image", mirrored[partner], found.positions, rel=1e-7, scale=LENGTH), at_rest(found)
    )
