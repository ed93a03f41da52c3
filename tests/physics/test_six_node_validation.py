"""Second-order shells against references: closed forms, series, and results of other codes."""

import numpy as np
import pytest

import magshell as ms
from benchmarks.cases import cylinder_roof, hemisphere, magnetic_strip, plates
from benchmarks.cases.buckling_loads import columns
from benchmarks.cases.linear_cylinders import pinched_cylinder, scordelis_lo
from benchmarks.cases.rolled_strip import end_moment
from benchmarks.convergence import REQUIRED_ORDER, STUDIES, converge

IRREGULAR = 0.25


def last(outcome):
    return np.array([comparison.computed[-1] for comparison in outcome.comparisons])


def order(cells, errors) -> float:
    return float(-np.polyfit(np.log(cells), np.log(errors), 1)[0])


@pytest.mark.parametrize("study", STUDIES)
def test_order_of_convergence_of_strips(study):
    """Check A1 at full load and C1-90 at beta = 20 on three irregular meshes of each fineness; the elastica
    stretches.
    """
    found = converge(study, "midedge2")
    assert found.order >= REQUIRED_ORDER["midedge2"]
    assert found.mean_errors[-1] < 1e-6


@pytest.fixture(scope="module")
def square_plates():
    """Return the errors of case B5's four deflections on irregular meshes of 4, 8, 16 cells."""
    runs = [plates.square_plate((n, n), "midedge2", irregular=IRREGULAR) for n in (4, 8, 16)]
    return {c.quantity: [run.comparisons[k].error for run in runs] for k, c in enumerate(runs[0].comparisons)}


@pytest.mark.parametrize("support", ["supported", "clamped"])
def test_order_of_the_plate_under_pressure(square_plates, support):
    errors = square_plates[f"{support}, pressure"]
    assert order((4, 8, 16), errors) >= 3.7 and errors[-1] < 1e-5


def test_plates_have_the_deflections_of_the_series(square_plates):
    """Compare B5 with the series of Navier and Ritz, and the disk with closed forms."""
    assert max(errors[-1] for errors in square_plates.values()) < 2e-4
    disk = plates.circular_plate(8, "midedge2")
    errors = {c.quantity: c.error for c in disk.comparisons}
    assert max(errors["supported, pressure"], errors["clamped, pressure"]) < 3e-5
    assert max(errors.values()) < 6e-3  # under the force, where the mesh is even


def test_scordelis_lo_roof_has_the_reference_deflection():
    """Compare case B1 with 0.3006 of Kirchhoff-Love theory, isogeometric (PENGoLINS)."""
    assert scordelis_lo((16, 16), "midedge2", irregular=IRREGULAR).comparisons[0].error < 2e-4


def test_pinched_cylinder_has_the_reference_deflection():
    """Compare case B2 with the limit of Kirchhoff-Love theory, 1.82842e-5."""
    assert pinched_cylinder((32, 32), "midedge2").comparisons[0].computed[0] == pytest.approx(
        1.82842e-5, rel=1e-4
    )


def test_hemisphere_pulled_and_pushed():
    """Compare case A4 with the limit of Kirchhoff-Love theory, 4.0742 and 8.1495."""
    pulled, pushed = last(hemisphere.large_deflection((64, 16), "midedge2"))
    assert (pulled, pushed) == (pytest.approx(4.0742, rel=2e-3), pytest.approx(8.1495, rel=2e-3))


@pytest.mark.filterwarnings("ignore::magshell.UnitWarning")
def test_a_field_is_a_force_at_the_end():
    """Compare case C4 by the divergence theorem, to round-off of the solves."""
    field = magnetic_strip.magnetic_end_shear((5, 1), "midedge2")
    assert max(comparison.error for comparison in field.comparisons) < 1e-9


def test_rolled_by_a_couple():
    """Compare case A2: an arc of 180 degrees."""
    rolled = end_moment((12, 1), "midedge2", loads=(0.5,))
    assert max(comparison.error for comparison in rolled.comparisons) < 3e-4


def test_columns_buckle_at_eulers_loads():
    """Compare case B7 with Euler's loads."""
    assert columns((20, 2), "midedge2").comparisons[0].error < 1e-4


def test_snap_through_is_followed():
    """Compare both limit points of case A7a with Sze, Liu, Lo 2004.

    Their shells shear under the force (2.6 % of the full load at the end).
    """
    snap = cylinder_roof.snap_through((4, 4), "midedge2", max_step=0.02)
    assert snap.comparisons[0].error < 0.03


def test_sphere_under_pressure():
    """Check an eighth, to first order: the radius grows by p R^2 (1 - nu) / (2 E h), membrane forces are p R / 2."""
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
