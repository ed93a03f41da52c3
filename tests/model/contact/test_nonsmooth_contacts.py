"""Reported nonsmooth vertices of a motion: at sharp edges and in the middle of bodies, nowhere else."""

import numpy as np
import pytest
from blocks import block_on, block_sheet, simulated

import magshell as ms

SHEET = block_sheet(young_modulus=1e6)
MIDDLE = SHEET.mesh.vertices_at(x=0.01)
HALF_DIAGONAL = np.sqrt(0.5) * 0.1


def ridge(**options):
    """Return a box with an edge upwards, right under the middle of the sheet."""
    given = {"center": (0.01, 0.01, -HALF_DIAGONAL), "rotation": (0, np.pi / 4, 0), **options}
    return ms.obstacles.Box((0.1, 0.1, 0.1), **given)


def pressed_on(obstacle, steps=3, **options):
    return simulated(block_on(obstacle, sheet=SHEET, **options), steps, 1e-3, velocities=(0, 0, -1e-3))


def test_sharp_edge_makes_a_nonsmooth_vertex():
    motion = pressed_on(ridge())
    assert list(motion.nonsmooth_vertices) == [
        1,
        2,
    ]  # not in contact at the start and at the end
    for vertices in motion.nonsmooth_vertices.values():
        np.testing.assert_array_equal(vertices, MIDDLE)


@pytest.mark.parametrize(
    "obstacle",
    [
        ms.obstacles.Plane(center=(0, 0, -1e-7)),
        ms.obstacles.Sphere(0.01, center=(0.01, 0.01, -0.01)),
        ridge(rounding=5e-3, center=(0.01, 0.01, 5e-3 * (np.sqrt(2) - 1) - HALF_DIAGONAL)),
        ms.obstacles.Box((0.1, 0.1, 0.1), center=(0, 0, -0.05)),
        ms.obstacles.bump(2e-3, 5e-3, center=(0.01, 0.01, -2e-3)),
    ],
    ids=repr,
)
def test_smooth_bodies_and_the_sides_of_sharp_ones_have_none(obstacle):
    motion = pressed_on(obstacle, steps=10)
    assert motion.energies["contact"].max() > 0
    assert motion.nonsmooth_vertices == {}


def test_points_on_faces_count_by_their_vertices():
    face = 0
    under = SHEET.mesh.rest_positions[SHEET.mesh.faces[face]].mean(axis=0)
    sharp = ms.obstacles.Box(
        (0.1, 0.1, 0.1), center=under - [0, 0, HALF_DIAGONAL], rotation=(0, np.pi / 4, 0)
    )
    motion = pressed_on(sharp, face_samples=1)
    assert set(SHEET.mesh.faces[face]) <= set(motion.nonsmooth_vertices[1])


def test_nonsmooth_vertices_follow_a_moving_obstacle():
    """Check that the edge moves with the obstacle's center and motion."""
    box = ridge(motion=lambda t: (2.5 * t, 0, 0))
    scene = block_on(box, sheet=SHEET)
    moved = {box: {"center": box.center + np.array([-5e-3, 0, 0])}}
    motion = simulated(scene, 4, 1e-3, velocities=(0, 0, -1e-3), values=moved)
    assert list(motion.nonsmooth_vertices) == [2]


def test_motion_without_contact_has_no_nonsmooth_vertices():
    scene = ms.Scene(SHEET, water=ms.Water(), allow_rigid_motions=True)
    assert simulated(scene, 2, 1e-3).nonsmooth_vertices == {}


def test_a_gradient_at_an_edge_is_that_of_a_side():
    """Check gradients on both sides of an edge.

    A shift by a nanometre makes the edge push to the other side: the motion jumps, the gradients are exact on either side.
    """
    torch = pytest.importorskip("torch")
    weights = torch.from_numpy(np.random.default_rng(1).standard_normal((SHEET.mesh.n_vertices, 3)))
    box = ridge()
    scene = block_on(box, sheet=SHEET)

    def loss(shift):
        center = torch.tensor(box.center.tolist(), dtype=torch.float64) + shift * torch.tensor(
            [1.0, 0.0, 0.0]
        )
        options = {"values": {box: {"center": center}}, "solver": ms.Newton(tolerance=1e-13)}
        motion = simulated(scene, 3, 1e-3, velocities=(0, 0, -1e-3), **options)
        assert motion.nonsmooth_vertices
        return (1e3 * torch.as_tensor(motion.positions[-1]) * weights).sum()

    values, step = [], 5e-10
    for side in (-1e-9, 1e-9):
        shift = torch.tensor(side, dtype=torch.float64, requires_grad=True)
        values.append(loss(shift))
        values[-1].backward()
        difference = (loss(side + step) - loss(side - step)) / (2 * step)
        assert shift.grad.item() == pytest.approx(difference.item(), rel=1e-5)
    assert abs(values[1] - values[0]).item() > 0.1
