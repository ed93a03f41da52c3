"""Thickness over length from 1e-5 to 1e-1: bending and membrane stiffness differ by up to 1e10."""

from __future__ import annotations

import numpy as np
from answers import at_rest, both, near
from registry import case
from sheets import LENGTH, YOUNG_MODULUS, cantilever, end_position, ends, force_for, shell, strip
from theory import elastica

import magshell as ms

RATIOS = (1e-5, 1e-4, 1e-3, 1e-2, 1e-1)


@case("thickness over length {:g}, from flat in one call", over=RATIOS)
def bent_far(ratio):
    mesh = strip((40, 4))
    sheet = shell(mesh, thickness=ratio * LENGTH)
    found = ms.equilibrium(cantilever(sheet, (0, 0, force_for(4.0, sheet, LENGTH))))
    end = end_position(mesh, found.positions) / LENGTH
    # A thick strip stretches by P / (E A) = ratio^2 / 3.
    return both(near("end x, z", end[[0, 2]], elastica(4.0), rel=1e-3 + ratio**2, scale=1.0), at_rest(found))


@case("thickness over length {:g}, rolled up by 324 degrees", over=(1e-6, 1e-5, 1e-3))
def rolled_up(ratio):
    """Compare a strip rolled up by 1.8 pi with a circle; beyond the full circle it would buckle out of its plane."""
    mesh = strip((40, 2))
    sheet = shell(mesh, thickness=ratio * LENGTH)
    near_end, far_end = ends(mesh)
    angle = 1.8 * np.pi
    couple = ms.EdgeCouple(far_end, -angle * YOUNG_MODULUS * (ratio * LENGTH) ** 3 / 12.0 / LENGTH)
    found = ms.equilibrium(ms.Scene(sheet, supports=[ms.Clamp(near_end)], loads=[couple]))
    end = end_position(mesh, found.positions)[[0, 2]] / LENGTH
    circle = np.array([np.sin(angle), 1.0 - np.cos(angle)]) / angle
    return both(near("end x, z", end, circle, rel=1e-3, scale=1.0), at_rest(found))


@case(
    "thickness over length {:g}: a buckling load of 1e-10 of the membrane stiffness at the least",
    over=(1e-5, 1e-1),
)
def euler_column(ratio):
    sheet = shell(strip((40, 4)), thickness=ratio * LENGTH)
    scene = cantilever(sheet, (-force_for(np.pi**2 / 4.0, sheet, LENGTH), 0, 0))
    return near("load over Euler's", ms.linear_buckling(scene).factors[0], 1.0, rel=2e-3 + 4 * ratio**2)


@case("a step in thickness of 1 to 100: bending stiffnesses 1e6 apart")
def stepped_beam():
    mesh = strip((40, 2))
    outer = mesh.face_barycenters[:, 0] > LENGTH / 2
    thin, thick = 1e-5, 1e-3
    sheet = shell(mesh, thickness=np.where(outer, thin, thick))
    force = 1e-12
    found = ms.linear_response(cantilever(sheet, (0, 0, force)))
    # The outer half is a cantilever; the inner half rotates and lifts it.
    half = LENGTH / 2
    soft, stiff = (YOUNG_MODULUS * h**3 / 12.0 for h in (thin, thick))
    expected = force * half**3 / (3.0 * soft) + force * (LENGTH**3 - half**3) / (3.0 * stiff)
    return near("end z", end_position(mesh, found.displacements)[2], expected, rel=1e-2)
