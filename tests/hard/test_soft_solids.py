"""The pressures of the soft solids act on their inner sides."""

import numpy as np
import pytest
from soft_solids import thick_tube, ventricle

import magshell as ms


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_apex_of_the_ventricle_goes_where_others_have_found_it():
    """Compare with -26.6 mm, about which the results in Land et al. 2015 lie, on a coarse mesh."""
    scene = ventricle(4, 1)
    rest = ms.equilibrium(scene, progress=False)
    apex = np.argmin(np.abs(scene.bodies[0].mesh.rest_positions - [0, 0, -0.017]).sum(axis=1))
    assert rest.positions[apex, 2] == pytest.approx(-26.6e-3, abs=0.6e-3)


def test_pressures_of_the_thick_tube_act_on_its_inner_side_and_its_end():
    scene = thick_tube(1e3)
    mesh = scene.bodies[0].mesh
    inside, end = (mesh.rest_positions[mesh.faces[load.faces]] for load in scene.loads)
    assert np.hypot(inside[..., 0], inside[..., 1]).max() < 0.0101 and inside[..., 2].max() > 0.0199
    assert np.abs(end[..., 2] - 0.02).max() < 1e-12
