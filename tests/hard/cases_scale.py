"""Scales from a micron to a thousand kilometres, positions far from the origin, and moduli of any size."""

from __future__ import annotations

import numpy as np
from answers import both, near
from registry import case
from sheets import shell, strip

import magshell as ms

SIZES = (1e-6, 1e-3, 1e3, 1e6)


def buckled(size: float = 1.0, modulus: float = 1e6, shift=(0.0, 0.0, 0.0)) -> ms.Equilibrium:
    """Compute the equilibrium of a clamped strip of length `size` [m], shortened to four times the critical value."""
    mesh = strip((20, 2), length=size, width=0.1 * size)
    ends = mesh.edges_at(x=0.0), mesh.edges_at(x=size)
    mesh = mesh.transformed(translation=shift)
    thickness = 1e-2 * size
    shortening = 4.0 * np.pi**2 * thickness**2 / (3.0 * size)
    sheet = shell(mesh, thickness=thickness, young_modulus=modulus)
    supports = [ms.Clamp(ends[0]), ms.Clamp(ends[1], displacement=(-shortening, 0, 0))]
    # A small load to one side, so that all of them buckle to it.
    load = ms.AreaLoad((0, 0, 1e-7 * modulus))
    return ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[load]))


@case("a length of {:g} m instead of 1 m", over=SIZES)
def buckled_strip(size):
    here, there = buckled(), buckled(size)
    return both(
        near("displacements / size", there.displacements / size, here.displacements, rel=1e-7),
        near("energy / size^3", there.energy / size**3, here.energy, rel=1e-7),
    )


@case("a modulus of {:g} Pa instead of 1e6 Pa", over=(1e-6, 1e15))
def buckled_strip_of_modulus(modulus):
    here, there = buckled(), buckled(modulus=modulus)
    return near("displacements", there.displacements, here.displacements, rel=1e-7)


@case("{:g} lengths from the origin", over=(1e3, 1e6))
def buckled_strip_from_afar(distance):
    """Compare with the strip at the origin; positions lose digits in proportion to the distance.

    Half of the remaining digits are lost in buckling.
    """
    here, there = buckled(), buckled(shift=(distance, -distance, 0.5 * distance))
    return near("displacements", there.displacements, here.displacements, rel=1e-10 * distance)


@case("a length of {:g} m instead of 1 m, moving: times go with it", over=SIZES)
def swinging_strip(size):
    def swing(length):
        mesh = strip((10, 1), length=length, width=0.1 * length)
        sheet = shell(mesh, thickness=1e-2 * length, mass_density=1e3)
        load = ms.EdgeLoad(mesh.edges_at(x=length), (0, 0, 0.3e-6 * 1e6 * length))
        scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], loads=[load])
        # A membrane wave travels from end to end in length sqrt(rho / E).
        return ms.simulate(scene, steps=30, time_step=10.0 * length * np.sqrt(1e3 / 1e6), progress=False)

    here, there = swing(1.0), swing(size)
    return near("displacements(t) / size", there.displacements / size, here.displacements, rel=1e-7)
