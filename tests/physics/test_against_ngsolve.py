"""Second-order shells compared with NGSolve's of order 2 with Regge's elements of order 1: the same to round-off."""

import numpy as np
import pytest

import magshell as ms
from benchmarks.cases import linear_cylinders, plates, shear_strip

ng = pytest.importorskip("ngsolve", reason="NGSolve is installed by hand where these are to run")
from benchmarks.baselines import ngsolve_cases, ngsolve_linear, ngsolve_strips  # noqa: E402
from benchmarks.baselines.ngsolve_mesh import netgen_mesh  # noqa: E402


@pytest.mark.parametrize("support", ["supported", "clamped"])
@pytest.mark.parametrize("cells", [2, 4, 8])
def test_plate_under_pressure(cells, support):
    """Compare case B5, to first order: a quarter of it, irregular, graded."""
    flat = plates.graded_quarter((cells, cells), irregular=0.25)
    mesh = ms.QuadraticTriangleMesh.from_triangles(flat)
    nu = plates.POISSON_RATIO
    sheet = ms.Shell(mesh, thickness=plates.THICKNESS, young_modulus=plates.YOUNG_MODULUS, poisson_ratio=nu)
    rim = mesh.edges_where(lambda middles: middles[:, :2].max(axis=1) > 0.5 - 1e-9)
    held = ms.Clamp(rim) if support == "clamped" else ms.Pin(np.unique(mesh.nodes_of_edges[rim]))
    symmetry = [ms.SymmetryPlane((1, 0, 0)), ms.SymmetryPlane((0, 1, 0))]
    scene = ms.Scene(sheet, supports=[held, *symmetry], loads=[ms.AreaLoad((0, 0, 1.0))])
    found = ms.linear_response(scene).displacements[: flat.n_vertices, 2]

    names = {"rim": lambda x: x[:2].max() > 0.5 - 1e-9, "symmetry": lambda _: True}
    clamped = "rim|symmetry" if support == "clamped" else "symmetry"
    theirs = ngsolve_linear.plate(
        netgen_mesh(flat, names, dim=2), 2, 1.0, nu, "rim", clamped, lambda v: v * ng.dx
    ).displacements[:, 0]
    assert found == pytest.approx(theirs, abs=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("cells", [4, 6, 8])
def test_curved_roof_equals_ngsolve(cells):
    """Compare case B1, to first order: all displacements of an irregular quarter of it, on curved elements of the
    same shape.
    """
    span = (0.0, linear_cylinders.ROOF_HALF_ANGLE)
    mesh = ms.meshes.cylinder(
        linear_cylinders.ROOF_RADIUS,
        linear_cylinders.ROOF_LENGTH / 2,
        span,
        cells=(cells, cells),
        irregular=0.25,
        order=2,
    )
    found = linear_cylinders.roof_response(mesh, "midedge2").displacements[: mesh.corners.n_vertices]
    theirs = ngsolve_cases.roof_on(mesh, order=2, onto=False).displacements
    assert found == pytest.approx(theirs, abs=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("cells", [(5, 1), (6, 2), (8, 2)])
def test_sheared_strip_equals_ngsolve(cells):
    """Compare case A1 at its full load, through large rotations; NGSolve integrates by the same points."""
    length, force = shear_strip.LENGTH, shear_strip.FULL_LOAD
    flat = shear_strip.strip(cells, "midedge")
    mesh = ms.QuadraticTriangleMesh.from_triangles(flat)
    scene = shear_strip.scene(mesh, "midedge2")
    found = ms.equilibrium(scene, solver=ms.MixedNewton(tolerance=1e-13)).displacements[: flat.n_vertices]
    names = {"left": lambda x: x[0] < 1e-9, "right": lambda x: x[0] > length - 1e-9, "free": lambda _: True}
    other = netgen_mesh(flat, names)
    material = ngsolve_linear.Material(shear_strip.THICKNESS, shear_strip.YOUNG_MODULUS, 0.0)

    def pull(factor, u, _):
        return -factor * force * u[2] * ng.ds(definedon=other.BBoundaries("right"))

    theirs = ngsolve_strips.strip(other, 2, material, pull, loads=10, tolerance=1e-22).displacements
    assert found == pytest.approx(theirs, abs=1e-8)
