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
    ("angle", "beta", "most"),  # before strays were halved: 159, 196; 8 as now
    [(150, 5.0, 45), (150, 20.0, 80), (30, 20.0, 9)],
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


def test_a_strip_buckles_to_the_side_that_its_load_pushes():
    """Plain steps from rest to the end are fewer, but they end on the other side, which is stable too."""
    mesh = ms.meshes.rectangle(1.0, 0.1, cells=(20, 2))
    sheet = ms.Shell(mesh, thickness=1e-2, young_modulus=1e6, poisson_ratio=0.3)
    pushed = ms.Clamp(mesh.edges_at(x=1.0), displacement=(-4e-4 * np.pi**2 / 3.0, 0, 0))
    supports = [ms.Clamp(mesh.edges_at(x=0.0)), pushed]
    for sign in (1.0, -1.0):
        load = ms.AreaLoad((0, 0, sign * 0.1))
        found = ms.equilibrium(ms.Scene(sheet, supports=supports, loads=[load]))
        assert found.stable
        heights = sign * found.positions[:, 2]
        assert heights.max() > 1e-2 and heights.min() > -1e-3
