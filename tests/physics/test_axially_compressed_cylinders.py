"""Buckling of cylinders under axial compression, against the closed form for simply supported edges (SS3)."""

import numpy as np
import pytest

import magshell as ms

YOUNG_MODULUS = 1e6  # Pa


def classical(radius, thickness):
    """Return the classical load without Poisson's ratio, E t2 / (sqrt(3) R) [N/m] (Lorenz 1908, Timoshenko 1910)."""
    return YOUNG_MODULUS * thickness**2 / (radius * np.sqrt(3.0))


def exact_load(radius, thickness, length, m, n):
    """Return the load [N/m] of the mode with m half-waves along and n waves around, without Poisson's ratio.

    Displacements u = U cos(a x) cos(n s), v = V sin(a x) sin(n s), w = W sin(a x) cos(n s) meet the edges' conditions
    v = w = 0, N_x = M_x = 0. Energy of a thin shell by J. L. Sanders (NASA TR R-24, 1959); the load does work on
    (u_x^2 + v_x^2 + w_x^2) / 2.
    """
    a, q = m * np.pi / length, n / radius
    stretches = [(-a, 0.0, 0.0), (0.0, q, 1.0 / radius)]
    curvatures = [(0.0, 0.0, a * a), (0.0, q / radius, q * q)]
    shear, twist = (-q, a, 0.0), (0.25 * q / radius, 0.75 * a / radius, a * q)
    bending = YOUNG_MODULUS * thickness**3 / 12.0
    stiffness = sum(YOUNG_MODULUS * thickness * np.outer(e, e) for e in stretches)
    stiffness = stiffness + sum(bending * np.outer(k, k) for k in curvatures)
    turns = float(n > 0)  # modes without waves around have neither v nor shear
    stiffness += turns * (0.5 * YOUNG_MODULUS * thickness * np.outer(shear, shear))
    stiffness += turns * (2.0 * bending * np.outer(twist, twist))
    moving = [0, 1, 2] if n else [0, 2]
    inverse = np.linalg.inv(stiffness[np.ix_(moving, moving)])
    return 1.0 / (a * a * np.linalg.eigvals(inverse).real.max())


def factors(radius, thickness, length, cells, modes):
    """Return the lowest factors of the classical load of a quarter of half a cylinder, with symmetric modes only."""
    mesh = ms.meshes.cylinder(radius, length / 2, (0.0, np.pi / 2), cells=cells, order=2)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=YOUNG_MODULUS, poisson_ratio=0.0)
    edges = mesh.edges_at(y=length / 2)
    supports = [*(ms.SymmetryPlane(axis) for axis in np.eye(3)), ms.Pin(mesh.vertices_at(y=length / 2), "xz")]
    load = ms.EdgeLoad(edges, (0.0, -classical(radius, thickness), 0.0))
    scene = ms.Scene(sheet, supports=supports, loads=[load])
    return np.asarray(ms.linear_buckling(scene, modes=modes).factors)


@pytest.mark.parametrize(
    "slenderness, half_waves, cells", [(50, 4, (12, 8)), (100, 5, (16, 10))], ids=["R/t 50", "R/t 100"]
)
def test_loads_of_simply_supported_cylinders_match_the_closed_form(slenderness, half_waves, cells):
    """Check the three lowest modes; the lowest buckles at 95.7 % of the classical load (R/t = 50), and at 99.3 %."""
    radius, thickness = 1.0, 1.0 / slenderness
    length = half_waves * np.pi * np.sqrt(radius * thickness) / 12.0**0.25
    modes = [(m, n) for m in range(1, 16, 2) for n in range(0, 25, 2)]  # symmetric about all three planes
    exact = np.sort([exact_load(radius, thickness, length, m, n) for m, n in modes])[:3]
    expected = exact / classical(radius, thickness)
    found = factors(radius, thickness, length, cells, modes=3)
    assert found == pytest.approx(expected, rel=3e-3)  # measured: 7e-4 at most
    assert expected[0] < 0.995


def test_the_classical_load_is_that_of_waves_without_waves_around():
    radius, thickness = 1.0, 0.01
    length = 5.0 * np.pi * np.sqrt(radius * thickness) / 12.0**0.25
    load = exact_load(radius, thickness, length, 5, 0)
    assert load == pytest.approx(classical(radius, thickness), rel=1e-12)
