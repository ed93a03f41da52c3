"""Rings under diametral forces and outer pressure, and a cantilever under a pressure that follows it, by beam theory."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import magshell as ms

RADIUS, WIDTH, THICKNESS, MODULUS = 0.05, 0.01, 1e-3, 1e6
RIGIDITY = MODULUS * THICKNESS**3 / 12  # per width


def ring(thickness: float):
    """Build a ring about the y axis that may only deform in its plane: the mesh, the shell and the supports."""
    mesh = ms.meshes.cylinder(RADIUS, WIDTH, cells=(32, 1), order=2)
    shell = ms.Shell(mesh, thickness=thickness, young_modulus=MODULUS, poisson_ratio=0.0)
    return mesh, shell, [ms.SymmetryPlane((0, 1, 0), (0, y, 0)) for y in (0.0, WIDTH)]


def test_ring_under_diametral_forces_deflects_as_in_tables() -> None:
    """Check against (pi/4 - 2/pi) P R^3/(E I) and (2/pi - 1/2) P R^3/(E I), Roark's Formulas for Stress and Strain."""
    mesh, shell, planes = ring(THICKNESS)
    force = 1e-3 * RIGIDITY / RADIUS**2
    top, bottom = (mesh.edges_at(x=0.0, z=z) for z in (RADIUS, -RADIUS))
    held = [
        ms.Pin(mesh.nearest_vertex((0, 0, -RADIUS)), "xz"),
        ms.Pin(mesh.nearest_vertex((0, 0, RADIUS)), "x"),
    ]
    loads = [ms.EdgeLoad(top, (0, 0, -force)), ms.EdgeLoad(bottom, (0, 0, force))]
    moved = ms.equilibrium(ms.Scene(shell, supports=[*planes, *held], loads=loads)).displacements
    up, down, side = (mesh.vertices_at(x=x, z=z) for x, z in ((0, RADIUS), (0, -RADIUS), (RADIUS, 0)))
    unit = force * RADIUS**3 / RIGIDITY
    closer = moved[down, 2].mean() - moved[up, 2].mean()
    assert closer == pytest.approx((np.pi / 4 - 2 / np.pi) * unit, rel=5e-3)
    assert 2 * moved[side, 0].mean() == pytest.approx((2 / np.pi - 0.5) * unit, rel=5e-3)


def test_ring_buckles_under_a_pressure_that_follows_it() -> None:
    """Check against 3 E I/R^3, twice, for both directions of the oval."""
    mesh, shell, planes = ring(THICKNESS / 4)
    sides = [mesh.nearest_vertex((x, 0, 0)) for x in (RADIUS, -RADIUS)]
    held = [ms.Pin(sides, "z"), ms.Pin(mesh.nearest_vertex((0, 0, RADIUS)), "x")]
    scene = ms.Scene(shell, supports=[*planes, *held], loads=ms.Pressure(1.0))
    factors = ms.linear_buckling(scene, modes=2).factors
    assert factors == pytest.approx(2 * [3 * RIGIDITY / 4**3 / RADIUS**3], rel=3e-3)


def test_cantilever_under_a_pressure_that_follows_it_is_the_elastica() -> None:
    length = 0.1
    pressure = 6 * RIGIDITY / length**3

    def along(_, y):
        angle, moment, force_x, force_z = y[2:]
        across = force_x * np.sin(angle) - force_z * np.cos(angle)
        load = pressure * np.array([-np.sin(angle), np.cos(angle)])
        return np.array([np.cos(angle), np.sin(angle), moment / RIGIDITY, across, *load])

    places = np.linspace(0, length, 50)
    start = np.zeros((6, 50))
    start[0] = places
    exact = solve_bvp(along, lambda a, b: np.array([*a[:3], *b[3:]]), places, start, tol=1e-9).y[:2, -1]
    mesh = ms.meshes.rectangle(length, WIDTH, cells=(20, 2), order=2)
    sheet = ms.Shell(mesh, thickness=THICKNESS, young_modulus=MODULUS, poisson_ratio=0.0)
    scene = ms.Scene(sheet, supports=ms.Clamp(mesh.edges_at(x=0.0)), loads=ms.Pressure(pressure))
    tip = ms.equilibrium(scene).positions[mesh.vertices_at(x=length)].mean(axis=0)
    assert tip[[0, 2]] == pytest.approx(exact, abs=5e-4 * length)
