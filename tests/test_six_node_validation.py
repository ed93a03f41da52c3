"""Second-order shells against references: closed forms, series, and what other codes find in the limit."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import magshell as ms
from magshell.bench.cases import cylinder_roof, hemisphere, magnetic_strip, plates, shear_strip
from magshell.bench.cases.buckling_loads import columns
from magshell.bench.cases.linear_cylinders import pinched_cylinder, scordelis_lo
from magshell.bench.cases.rolled_strip import end_moment

EXACT = ms.MixedNewton(tolerance=1e-13)
IRREGULAR = 0.25
SEEDS = (0, 1, 2)


def elastica(length, EA, EI, force):
    """(x, z) of the end of a strip that stretches: bending EI/2 (s theta')^2 and membrane EA/8 (s^2 - 1)^2 a rest length, s
    its stretch, under a dead end force along z. Both momenta are continuous: m = EI s^2 theta' and, as nothing depends on
    ds/dS, m^2 / (EI s^3) + EA (s^3 - s) / 2 = P sin(theta)."""

    def stretch(angle, m):
        s = 1.0
        for _ in range(20):
            value = m * m / (EI * s**3) + EA * (s**3 - s) / 2 - force * np.sin(angle)
            s -= value / (EA * (3 * s**2 - 1) / 2 - 3 * m * m / (EI * s**4))
        return s

    def rates(_, y):
        angle, m = y[:2]
        s = stretch(angle, m)
        return [m / (EI * s**2), -force * s * np.cos(angle), s * np.cos(angle), s * np.sin(angle)]

    def end(m):
        start = [0.0, m, 0.0, 0.0]
        return solve_ivp(rates, (0, length), start, rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]

    largest = np.sqrt(2 * force * EI)
    m = brentq(lambda m: end(m)[1], 0.5 * largest, 0.999999 * largest, xtol=1e-15 * largest)
    return end(m)[2:]


def last(outcome):
    return np.array([comparison.computed[-1] for comparison in outcome.comparisons])


def order(cells, errors) -> float:
    return float(-np.polyfit(np.log(cells), np.log(errors), 1)[0])


STRIPS = ((10, 1), (20, 2), (40, 4))


def test_order_of_the_sheared_strip():
    """A1 on irregular meshes."""
    x, z = elastica(10.0, 1.2e5, 100.0, 4.0)
    errors = [
        np.mean(
            [
                np.linalg.norm(
                    last(
                        shear_strip.end_shear(
                            cells, "midedge2", irregular=IRREGULAR, seed=seed, loads=(1.0,), solver=EXACT
                        )
                    )
                    - (z, 10.0 - x)
                )
                for seed in SEEDS
            ]
        )
        for cells in STRIPS
    ]
    assert order([cells[0] for cells in STRIPS], errors) >= 3.7
    assert errors[-1] < 1e-7 * 10.0


def test_order_of_the_magnetic_strip():
    """C1-90 at beta = 20 on irregular meshes: for a field across it a magnetized strip is one under a dead end force."""
    length, thickness = magnetic_strip.LENGTH, magnetic_strip.THICKNESS
    EI = magnetic_strip.YOUNG_MODULUS * thickness**3 / 12
    x, y = elastica(length, magnetic_strip.YOUNG_MODULUS * thickness, EI, 20.0 * EI / length**2)
    errors = [
        np.mean(
            [
                np.linalg.norm(
                    last(
                        magnetic_strip.field_across(
                            cells, "midedge2", irregular=IRREGULAR, seed=seed, betas=(20.0,), solver=EXACT
                        )
                    )
                    - np.array((x, y)) / length
                )
                for seed in SEEDS
            ]
        )
        for cells in STRIPS
    ]
    assert order([cells[0] for cells in STRIPS], errors) >= 3.7
    assert errors[-1] < 1e-6


@pytest.fixture(scope="module")
def square_plates():
    """B5, errors of the four deflections on irregular meshes of 4, 8, 16 cells."""
    runs = [plates.square_plate((n, n), "midedge2", irregular=IRREGULAR) for n in (4, 8, 16)]
    return {c.quantity: [run.comparisons[k].error for run in runs] for k, c in enumerate(runs[0].comparisons)}


@pytest.mark.parametrize("support", ["supported", "clamped"])
def test_order_of_the_plate_under_pressure(square_plates, support):
    errors = square_plates[f"{support}, pressure"]
    assert order((4, 8, 16), errors) >= 3.7 and errors[-1] < 1e-5


def test_plates(square_plates):
    """B5: Navier's series and Ritz's; closed forms of the disk."""
    assert max(errors[-1] for errors in square_plates.values()) < 2e-4
    disk = plates.circular_plate(8, "midedge2")
    errors = {c.quantity: c.error for c in disk.comparisons}
    assert max(errors["supported, pressure"], errors["clamped, pressure"]) < 3e-5
    assert max(errors.values()) < 6e-3  # under the force, where the mesh is even


def test_scordelis_lo():
    """B1: 0.3006 in Kirchhoff-Love theory, isogeometric (PENGoLINS)."""
    assert scordelis_lo((16, 16), "midedge2", irregular=IRREGULAR).comparisons[0].error < 2e-4


def test_pinched_cylinder():
    """B2: the limit of Kirchhoff-Love theory 1.82842e-5, by NGSolve's shells of order 3 on graded meshes."""
    assert pinched_cylinder((32, 32), "midedge2").comparisons[0].computed[0] == pytest.approx(
        1.82842e-5, rel=1e-4
    )


def test_hemisphere_pulled_and_pushed():
    """A4: the limit of Kirchhoff-Love theory 4.0742 and 8.1495, by NGSolve's shells of order 3."""
    pulled, pushed = last(hemisphere.large_deflection((64, 16), "midedge2"))
    assert (pulled, pushed) == (pytest.approx(4.0742, rel=2e-3), pytest.approx(8.1495, rel=2e-3))


def test_a_field_is_a_force_at_the_end():
    """C4: by the divergence theorem, to round-off of the solves."""
    field = magnetic_strip.magnetic_end_shear((5, 1), "midedge2")
    assert max(comparison.error for comparison in field.comparisons) < 1e-9


def test_rolled_by_a_couple():
    """A2: an arc of 180 degrees."""
    rolled = end_moment((12, 1), "midedge2", loads=(0.5,))
    assert max(comparison.error for comparison in rolled.comparisons) < 3e-4


def test_columns_buckle():
    """B7: Euler."""
    assert columns((20, 2), "midedge2").comparisons[0].error < 1e-4


def test_snap_through_is_followed():
    """A7a: both limit points; Sze, Liu, Lo 2004, whose shells shear under the force (2.6 % of the full load at the end)."""
    snap = cylinder_roof.snap_through((4, 4), "midedge2", largest_step=0.02)
    assert snap.comparisons[0].error < 0.03


def test_sphere_under_pressure():
    """An eighth, to first order: the radius grows by p R^2 (1 - nu) / (2 E h), membrane forces are p R / 2."""
    radius, thickness, modulus, nu, pressure = 1.0, 0.01, 1e6, 0.3, 1.0
    mesh = ms.meshes.spherical_cap(radius, 0.0, np.pi / 2, np.pi / 2, cells=(4, 4), order=2)
    sheet = ms.Shell(mesh, thickness=thickness, young_modulus=modulus, poisson_ratio=nu)
    planes = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    blown = ms.equilibrium(ms.Scene(sheet, supports=planes, loads=[ms.Pressure(-pressure)]))
    grown = np.linalg.norm(blown.positions, axis=1) - radius
    assert grown.mean() == pytest.approx(
        pressure * radius**2 * (1 - nu) / (2 * modulus * thickness), rel=3e-3
    )
    forces = blown[sheet].stresses().principal_membrane_forces
    assert forces.mean() == pytest.approx(pressure * radius / 2, rel=3e-3)
    assert np.abs(forces - pressure * radius / 2).max() < 0.05 * pressure * radius
