"""Supports that share vertices: each moves them along the directions that it holds."""

import numpy as np
import pytest
import torch

import magshell as ms
from magshell.model.supports.constraints import VertexConstraint, _frame
from magshell.model.supports.supports import RigidMove

MESH = ms.meshes.rectangle(0.1, 0.02, cells=(4, 1))
END = MESH.vertices_at(x=0.1)


def scene(*pins):
    sheet = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
    return ms.Scene(sheet, supports=[ms.Clamp(MESH.edges_at(x=0.0)), *pins])


def test_pins_along_different_axes_move_one_vertex_together():
    """Compare with one pin that moves the vertex along both axes; each pin has its own gradient."""
    one = ms.equilibrium(scene(ms.Pin(END, "xz", displacement=(1e-3, 0, 2e-3))))
    a, b = ms.Pin(END, "x", displacement=(1e-3, 0, 0)), ms.Pin(END, "z", displacement=(0, 0, 2e-3))
    two = scene(a, b)
    rest = ms.equilibrium(two)
    assert np.allclose(rest.positions, one.positions, atol=1e-12)
    assert np.allclose(rest.displacements[END][:, [0, 2]], (1e-3, 2e-3))

    def moved(x, z):
        return ms.equilibrium(two, values={a: {"displacement": x}, b: {"displacement": z}})

    vectors = [torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in ([1e-3, 0, 0], [0, 0, 2e-3])]
    weights = np.random.default_rng(0).normal(size=MESH.rest_positions.shape)
    (moved(*vectors).positions * torch.tensor(weights)).sum().backward()
    step = 1e-6
    for k, (vector, axis) in enumerate(zip(vectors, (0, 2), strict=True)):
        ends = []
        for sign in (-1, 1):
            given = [v.detach().numpy().copy() for v in vectors]
            given[k][axis] += sign * step
            ends.append((moved(*given).positions * weights).sum())
        assert vector.grad[axis] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-5)
        assert not vector.grad[[j for j in range(3) if j != axis]].any()


def test_each_vertex_has_the_pins_that_hold_it():
    ends = [ms.Pin(END[:1], "x", displacement=(1e-3, 0, 0)), ms.Pin(END, "yz", displacement=(0, 2e-4, 1e-3))]
    rest = ms.equilibrium(scene(*ends))
    assert np.allclose(rest.displacements[END[0]], (1e-3, 2e-4, 1e-3))
    assert np.allclose(rest.displacements[END[1]][1:], (2e-4, 1e-3))


def test_oblique_directions_keep_their_moves():
    """Check the local frame of a vertex with two moving directions and a fixed oblique one."""
    slant = np.array([[0.0, 0.6, 0.8]])
    moves = [RigidMove(np.zeros(3), np.zeros(3), by, None) for by in (np.eye(3)[0], np.array([0, -0.8, 0.6]))]
    along = [np.eye(3)[:1], np.array([[0.0, -0.8, 0.6]])]
    frame, count, by = _frame(
        [
            VertexConstraint(slant, None),
            VertexConstraint(along[0], moves[0]),
            VertexConstraint(along[1], moves[1]),
        ]
    )
    assert count == 3 and np.allclose(frame.T @ frame, np.eye(3))
    for direction, move in zip([along[0][0], along[1][0], slant[0]], [*moves, None], strict=True):
        column = int(np.argmax(np.abs(frame.T @ direction)))
        assert np.isclose(abs(frame[:, column] @ direction), 1.0) and by[column] is move


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("xy", (1e-3, 0, 0)), ("x", (2e-3, 0, 0))),
        (("xz", (1e-3, 0, 1e-3)), ("yz", (0, 0, 2e-3))),
    ],
)
def test_contradicting_moves_along_one_axis_are_refused(first, second):
    with pytest.raises(ValueError, match=r"two supports move vertex \d+ to different places"):
        scene(*(ms.Pin(END, along, displacement=by) for along, by in (first, second)))


def test_equal_moves_along_a_shared_axis_are_allowed():
    pins = [ms.Pin(END, "xz", displacement=(1e-3, 0, 1e-3)), ms.Pin(END, "yz", displacement=(0, 2e-4, 1e-3))]
    assert np.allclose(ms.equilibrium(scene(*pins)).displacements[END], (1e-3, 2e-4, 1e-3))
