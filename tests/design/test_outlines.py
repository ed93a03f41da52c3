"""Outlines by control points, and inner meshes that follow a boundary."""

import numpy as np
import pytest

import magshell as ms

torch = pytest.importorskip("torch")

MESH = ms.meshes.rectangle(0.1, 0.06, cells=(6, 4), irregular=0.2, seed=3)
BORDER = MESH.boundary_vertices


def _ring():
    disk = ms.meshes.disk(0.05, cells=6)
    outside = disk.faces[np.linalg.norm(disk.face_barycenters, axis=1) > 0.02]
    kept = np.unique(outside)
    return ms.TriangleMesh(disk.rest_positions[kept], np.searchsorted(kept, outside))


RING = _ring()


def test_an_affine_motion_of_the_boundary_takes_the_inside_along():
    turn = np.array([[1.1, 0.2, 0.0], [-0.1, 0.8, 0.3], [0.0, 0.4, 1.0]])
    wanted = MESH.rest_positions @ turn.T + (0.1, -0.2, 0.3)
    found = ms.parametrize.with_boundary(MESH, wanted[BORDER])
    assert found.numpy() == pytest.approx(wanted, rel=0, abs=1e-14)


def test_a_harmonic_motion_of_the_boundary_is_harmonic_inside():
    """Compare with x^2 - y^2, which the five-point formula of a regular grid has exactly."""
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(8, 8))
    x, y, _ = mesh.rest_positions.T
    wanted = mesh.rest_positions + np.outer(x**2 - y**2, (0, 0, 1))
    found = ms.parametrize.with_boundary(mesh, wanted[mesh.boundary_vertices])
    assert found.numpy() == pytest.approx(wanted, rel=0, abs=1e-13)


@pytest.mark.parametrize("mesh", [MESH, RING], ids=["sheet", "ring"])
def test_gradients_by_control_points_and_boundary_agree_with_differences(mesh):
    rng = np.random.default_rng(2)
    controls = torch.tensor(0.01 * rng.standard_normal((7, 3)), requires_grad=True)
    assert torch.autograd.gradcheck(
        lambda c: ms.parametrize.outline(mesh, c, len(mesh.boundary_loops) - 1), controls
    )
    boundary = torch.tensor(mesh.rest_positions[mesh.boundary_vertices], requires_grad=True)
    assert torch.autograd.gradcheck(lambda b: ms.parametrize.with_boundary(mesh, b), boundary)


def test_control_points_move_their_own_boundary_alone():
    loops = RING.boundary_loops
    moved = ms.parametrize.outline(RING, 0.01 * np.ones((5, 3)), loop=1).numpy() - RING.rest_positions
    assert moved[loops[1]] == pytest.approx(0.01, abs=1e-15)
    assert np.abs(moved[loops[0]]).max() < 1e-15


def test_a_control_point_moves_the_boundary_near_it_by_a_cubic_spline():
    """Check the weights 2/3 at a control point and 1/6 at its neighbours, where every fourth vertex is one."""
    mesh = ms.meshes.disk(0.05, cells=6)
    loop = mesh.boundary_loops[0]
    count = len(loop) // 4
    controls = np.zeros((count, 3))
    controls[0, 2] = 0.6
    heights = ms.parametrize.outline(mesh, controls).numpy()[loop, 2]
    assert heights[[0, 4, -4]] == pytest.approx([0.4, 0.1, 0.1], abs=1e-12)
    assert np.abs(heights[8:-7]).max() < 1e-12


def test_outlines_refuse_what_they_cannot_move():
    with pytest.raises(ValueError, match=r"controls \[m\] must have at least 4 rows, got 3"):
        ms.parametrize.outline(MESH, np.zeros((3, 3)))
    with pytest.raises(ValueError, match="loop must be one of the 1 boundaries"):
        ms.parametrize.outline(MESH, np.zeros((4, 3)), loop=1)
    with pytest.raises(ValueError, match=r"boundary \[m\] must have shape"):
        ms.parametrize.with_boundary(MESH, np.zeros((3, 3)))
    closed = ms.meshes.box((1, 1, 1), cells=(1, 1, 1)).surface
    with pytest.raises(ValueError, match="closed surface"):
        ms.parametrize.with_boundary(closed, np.zeros((0, 3)))
    with pytest.raises(ValueError, match="loop must be one of the 0 boundaries"):
        ms.parametrize.outline(closed, np.zeros((4, 3)))
