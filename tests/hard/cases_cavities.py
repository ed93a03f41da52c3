"""Cavities: blown far beyond their largest pressure, empty, filled in one call, crushed."""

from __future__ import annotations

import numpy as np
from answers import at_rest, both, near, refused
from registry import case
from scipy.optimize import brentq

import magshell as ms


def hollow_ball(cells=2, element="quadratic", hollow=0.5, axes=(1.0, 1.0, 1.0), material=None) -> ms.Solid:
    """Return a hollow ball, or an ellipsoid with these half axes.

    hollow: radius of the hollow over that of the ball.
    """
    ball = ms.meshes.ball(1.0, cells=cells)
    inner = np.linalg.norm(ball.rest_positions[ball.tetrahedra], axis=2).min(axis=1) < 0.5 - 1e-6
    kept, numbered = np.unique(ball.tetrahedra[~inner], return_inverse=True)
    x = ball.rest_positions[kept]
    radius = np.linalg.norm(x, axis=1, keepdims=True)
    x = x * (hollow + (radius - 0.5) * (1.0 - hollow) / 0.5) / radius if hollow != 0.5 else x
    mesh = ms.TetMesh(x * axes, numbered.reshape(-1, 4))
    material = material or ms.NeoHookean("isochoric", young_modulus=3.0, poisson_ratio=0.49)
    return ms.Solid(mesh, material=material, element=element)


def scene_of(body: ms.Solid, *actuators) -> ms.Scene:
    on = [np.flatnonzero(np.abs(body.mesh.rest_positions[:, k]) < 1e-9) for k in range(3)]
    pins = [ms.Pin(vertices, components="xyz"[k]) for k, vertices in enumerate(on)]
    return ms.Scene(body, supports=pins, actuators=actuators)


@case("a ball filled to {:g} times its hollow's volume in one call, by water", over=(3.0, 30.0))
def filled(times):
    body = hollow_ball()
    rest = ms.Cavity(body, pressure=0.0).rest_volume(scene_of(body))
    water = ms.Cavity(body, volume=times * rest, bulk_modulus=1e4)
    found = ms.equilibrium(scene_of(body, water))
    return both(at_rest(found), near("volume", float(found[water].volume), times * rest, rel=1e-3))


@case("a gas at {:g} times the pressure outside, from rest in one call", over=(0.0, 1e-6, 0.5, 30.0))
def gas(times):
    body = hollow_ball()
    inside = ms.Cavity(body, gas_pressure=0.3 * times, outside_pressure=0.3)
    found = ms.equilibrium(scene_of(body, inside))
    volume, pressure = float(found[inside].volume), float(found[inside].pressure)
    rest = inside.rest_volume(found.scene)
    return both(
        at_rest(found),
        near("p V + p_o V", (pressure + 0.3) * volume, 0.3 * times * rest, rel=1e-9)
        if times
        else near("pressure", pressure, -0.3, rel=1e-12),
    )


@case("a vacuum in a box of a sheet far too weak for it")
def crushed():
    box = ms.meshes.box((0.03, 0.03, 0.03), cells=(2, 2, 1))
    mesh = ms.TriangleMesh(box.rest_positions, box.faces)
    sheet = ms.Shell(mesh, thickness=2e-4, young_modulus=1e4)
    vacuum = ms.Cavity(sheet, gas_pressure=0.0)
    scene = ms.Scene(sheet, supports=[ms.Pin(mesh.vertices_at(z=0.0))], actuators=[vacuum])

    def solve():
        return ms.equilibrium(scene)

    return refused(solve, "", ms.NotConverged)


@case("sixty bordered groups of cells that want {:g} times their volume, in one call", over=(0.3, 3.0))
def grown(times):
    found, cells = swollen(times)
    ratios = found[cells].volume_ratios
    shear, lame = 1e4 / (2 * 1.3), 1e4 * 0.3 / (1.3 * 0.4)

    def over(j: float) -> float:
        """Return the excess pressure on a free block, by its material, (mu (J^2/3 - 1) + lam ln J)/J, and its cell."""
        return (shear * (np.cbrt(j) ** 2 - 1) + lame * np.log(j)) / j + 1e5 * (j - times)

    free = brentq(over, 0.1, 10.0)
    return both(at_rest(found), near("volume ratio", float(np.median(ratios)), free, rel=0.02))


def swollen(
    times: float, cells=(15, 4, 4), *, poisson_ratio=0.3, stiffness=1e5
) -> tuple[ms.Equilibrium, ms.PneumaticCells]:
    """Compute the equilibrium of a block of groups of cells that want `times` their volume."""
    mesh = ms.meshes.box((0.3, 0.1, 0.1), cells=cells)
    material = ms.NeoHookean(young_modulus=1e4, poisson_ratio=poisson_ratio)
    body = ms.Solid(mesh, material=material, element="linear")
    at = mesh.tetrahedron_barycenters
    number = (at[:, 0] / 0.02).astype(int) * 4 + 2 * (at[:, 1] > 0.05) + (at[:, 2] > 0.05)
    groups = ms.PneumaticCells(body, number, stiffness=stiffness, volume_ratio=times)
    scene = ms.Scene(body, supports=[ms.Pin(mesh.vertices_at(x=0.0))], actuators=[groups])
    return ms.equilibrium(scene), groups
