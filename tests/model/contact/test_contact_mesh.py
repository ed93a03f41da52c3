"""Dependence of body contact forces at a given gap on the meshes, as BodyContact's docstring states it."""

import numpy as np
import pytest
from body_contact_scenes import SOFT

import magshell as ms
from magshell.model.scene.contact_state import compute_contact_state

SIDE, GAP = 0.02, 0.5e-4  # m; the gap is half the reach
PRESSURE = -0.5 * (2 * np.log(0.5) - 1) * SOFT["young_modulus"]  # of the barrier there


def borne(lower, upper):
    """Compute the normal force between two sheets with these meshes, in N."""
    sheets = [ms.Shell(mesh, **SOFT) for mesh in (lower, upper)]
    touch = ms.Contact(*sheets)
    scene = ms.Scene(sheets, contacts=[touch], allow_rigid_motions=True)
    return compute_contact_state(scene, scene._values, touch, scene._model.rest_state()).normal_force


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("below", [4, 16])
@pytest.mark.parametrize("on_top", [4, 16])
@pytest.mark.parametrize("aside", [(0, 0), (3e-4, 2e-4)])
def test_flat_contact_bears_one_to_three_and_a_half_times_its_pressure(below, on_top, aside):
    """Check that vertex-face pairs make up the pressure; edge pairs add to it, most where meshes coincide."""
    lower, upper = (ms.meshes.rectangle(SIDE, SIDE, cells=(n, n)) for n in (below, on_top))
    found = borne(lower, upper.transformed(translation=(*aside, 1e-3 + GAP)))
    assert 1.0 < found / (PRESSURE * SIDE**2) < 3.5


def upright(cells, aside, low):
    """Return a sheet standing on its edge along x, or upside down along y."""
    mesh = ms.meshes.rectangle(SIDE, SIDE / 4, cells=(cells, cells // 4))
    along, up = mesh.rest_positions[:, 0] - SIDE / 2 + aside * SIDE / cells, mesh.rest_positions[:, 1]
    none = np.zeros(len(up))
    points = (along, none, up) if low == 0 else (none, along, low - up)
    return ms.TriangleMesh(np.stack(points, axis=1), mesh.faces)


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_edges_that_cross_bear_in_proportion_to_the_area_of_their_faces():
    """Check that the force of crossing edges scales with the area of their faces.

    A crossing has no area of its own. The meshes give it one, which is larger where vertices meet.
    """
    for aside in (0.0, 0.5):
        forces = [borne(upright(n, aside, 0), upright(n, aside, -1e-3 - GAP)) for n in (4, 8)]
        assert forces[0] / forces[1] == pytest.approx(4.0, rel=1e-3)
