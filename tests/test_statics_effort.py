"""How many factorizations equilibria take from rest in one call where steps of the load go astray, and where they end."""

import numpy as np
import pytest

import magshell as ms
from magshell.bench.cases import magnetic_strip
from magshell.bench.statics import oblique_field, semi_cylinder


@pytest.mark.parametrize(
    (
        "angle",
        "beta",
        "most",
    ),  # it took 38, 72, 76, 58, 190, 46; 8 and 9 as now. 30 at 150 degrees is the goal, the
    # other bounds were set after seeing 39, 42, 66 and 27
    [
        (150, 5.0, 30),
        (150, 20.0, 30),
        (150, 50.0, 45),
        (170, 5.0, 50),
        (170, 20.0, 75),
        (120, 20.0, 30),
        (30, 20.0, 9),
        (90, 5.0, 10),
    ],
)
def test_a_field_from_behind(angle, beta, most):
    scene, controls = oblique_field(angle, beta)
    found = ms.equilibrium(scene, **controls)
    assert found.stable and found.saddles_left == 0
    assert found.factorizations <= most
    # where the field leads as it turns from 30 degrees to its angle, without a jump
    warm = ms.equilibrium(scene, **oblique_field(30.0, beta)[1])
    for turned in np.linspace(30.0, angle, 13)[1:]:
        warm = ms.equilibrium(scene, start=warm, **oblique_field(turned, beta)[1])
    np.testing.assert_allclose(found.positions, warm.positions, atol=1e-6 * magnetic_strip.LENGTH)


@pytest.mark.parametrize(
    ("cells", "force", "most", "energy"),  # it took 794, 670, 1166, 2504 and 18, to the same energies
    [  # bounds set after seeing 81, 120, 76, 118 and 13: the goal is 60
        (8, 2000.0, 100, -1268.857),
        (16, 2000.0, 140, -1239.048),
        (8, -2000.0, 100, 69.50908),
        (16, -2000.0, 140, -74.71199),
        (24, 2000.0, 18, -1204.423),
    ],
)
@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_a_semi_cylinder_pulled_and_pushed(cells, force, most, energy):
    """On coarse meshes it snaps from fold to fold; which it ends in may depend on rounding, none may be higher."""
    found = ms.equilibrium(semi_cylinder(cells, force))
    assert found.stable and found.progress == 1.0
    assert found.energy <= energy + 1e-5 * abs(energy)
    assert found.factorizations <= most


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
