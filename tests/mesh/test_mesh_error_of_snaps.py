"""A pinched cylinder (A6: Sze, Liu, Lo 2004) on coarse meshes: its error is estimated before, and refused after the
snap.
"""

from __future__ import annotations

import numpy as np
import pytest

import magshell as ms

RADIUS, HALF_LENGTH, THICKNESS, YOUNG_MODULUS = 100.0, 100.0, 1.0, 30e3


def sunk(mesh, force: float) -> float:
    """Return the deflection of one eighth of the cylinder on rigid diaphragms under two opposite forces at
    mid-length.
    """
    bending = "midedge2" if isinstance(mesh, ms.QuadraticTriangleMesh) else "midedge"
    sheet = ms.Shell(
        mesh, thickness=THICKNESS, young_modulus=YOUNG_MODULUS, poisson_ratio=0.3, bending=bending
    )
    symmetric = [ms.SymmetryPlane(normal) for normal in np.eye(3)]
    diaphragm = ms.Pin(mesh.vertices_at(y=HALF_LENGTH), "xz")
    top = mesh.nearest_vertex((0.0, 0.0, RADIUS))
    loads = [ms.PointLoad(top, (0.0, 0.0, -force / 4))]
    rest = ms.equilibrium(ms.Scene(sheet, supports=[*symmetric, diaphragm], loads=loads))
    assert rest.stable  # on each mesh, and that tells nothing of the mesh
    return RADIUS - float(rest.positions[top, 2])


def meshes(coarsest: int, order: int) -> list:
    sizes = [coarsest, 2 * coarsest, 4 * coarsest]
    return [
        ms.meshes.cylinder(RADIUS, HALF_LENGTH, (0.0, np.pi / 2), cells=(n, n), order=order) for n in sizes
    ]


def test_error_before_the_snap_is_estimated():
    found = {
        order: ms.richardson_extrapolation(lambda mesh: sunk(mesh, 150.0), meshes(8 // order, order))
        for order in (1, 2)
    }
    assert found[1].error == pytest.approx(0.13, abs=0.03) and found[2].error < 0.02
    assert abs(found[2].value - found[1].value) < 0.02  # far closer than the finest mesh of first order
    assert abs(found[2].values[-1] - found[1].value) < 0.03


@pytest.mark.parametrize(("coarsest", "order"), [(8, 1), (4, 2)])
def test_extrapolation_beyond_the_snap_is_refused(coarsest, order):
    with pytest.raises(ms.NotConverged, match="does not converge with the mesh") as caught:
        ms.richardson_extrapolation(lambda mesh: sunk(mesh, 600.0), meshes(coarsest, order))
    seen = caught.value.last_good
    assert seen.error > 0.03 * seen.value
