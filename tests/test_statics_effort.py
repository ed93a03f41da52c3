"""How many factorizations equilibria take from rest in one call where steps of the load go astray, and where they end."""

import numpy as np
import pytest

import magshell as ms
from magshell.bench.cases import magnetic_strip


def oblique(angle: float, beta: float) -> tuple[ms.Scene, dict]:
    """C1: a strip of 20 cells in a field at an angle [degrees] to its magnetization. It does not snap."""
    mesh = ms.meshes.rectangle(magnetic_strip.LENGTH, magnetic_strip.WIDTH, cells=(10, 1))
    direction = (np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle)))
    return magnetic_strip.scene(mesh, "midedge"), magnetic_strip.controls(beta, direction)


@pytest.mark.parametrize(
    ("angle", "beta", "most"),  # before plain steps and strays: 159, 196, 164, 89; 8 as now
    [(150, 5.0, 45), (150, 20.0, 60), (170, 50.0, 65), (120, 50.0, 55), (30, 20.0, 9)],
)
def test_a_field_from_behind(angle, beta, most):
    scene, controls = oblique(angle, beta)
    found = ms.equilibrium(scene, **controls)
    assert found.stable and found.saddles_left == 0
    assert found.factorizations <= most
    # where the field leads as it turns from 30 degrees to its angle, without a jump
    warm = ms.equilibrium(scene, **oblique(30.0, beta)[1])
    for turned in np.linspace(30.0, angle, 13)[1:]:
        warm = ms.equilibrium(scene, start=warm, **oblique(turned, beta)[1])
    np.testing.assert_allclose(found.positions, warm.positions, atol=1e-6 * magnetic_strip.LENGTH)


def semi_cylinder(cells: int, force: float) -> ms.Scene:
    """Half of a semi-cylinder clamped at one end, a force on the top of the other (Sze, Liu, Lo 2004)."""
    radius, length = 1.016, 3.048
    mesh = ms.meshes.cylinder(radius, length, (0.0, np.pi / 2), cells=(cells, cells))
    sheet = ms.Shell(mesh, thickness=0.03, young_modulus=2.0685e7, poisson_ratio=0.3)
    supports = [
        ms.Clamp(mesh.edges_at(y=0.0)),
        ms.SymmetryPlane((1, 0, 0)),
        ms.SymmetryPlane((0, 0, 1)),
    ]
    top = mesh.nearest_vertex((0, length, radius))
    return ms.Scene(sheet, supports=supports, loads=[ms.PointLoad(top, (0, 0, force / 2))])


@pytest.mark.parametrize(("cells", "force"), [(8, 2000.0), (16, 2000.0), (8, -2000.0)])
@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_a_semi_cylinder_pulled_and_pushed(cells, force):
    """It took 794, 670 and 1166."""
    found = ms.equilibrium(semi_cylinder(cells, force))
    assert found.stable and found.progress == 1.0
    assert found.factorizations <= 60
