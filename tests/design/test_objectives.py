"""Objectives, penalties and parametrisations: known values, derivatives, bad input."""

import math

import numpy as np
import pytest
import torch
from torch.autograd import gradcheck

import magshell as ms
from magshell import objectives, parametrize

torch.manual_seed(0)
VECTORS = torch.randn(6, 3, dtype=torch.float64)
CASES = torch.randn(2, 6, 3, dtype=torch.float64)
AMPLITUDE = torch.randn(6, dtype=torch.float64)
EDGE_FACES = np.array([[0, 1], [1, 2], [3, -1], [2, 5], [-1, 4]], dtype=np.int32)
IMAGE = torch.rand(4, 5, dtype=torch.float64)
REST = torch.rand(6, 3, dtype=torch.float64)
INK = ms.PrintableSet(2.0, [[1.0, 0, 0], [0, 2.0, 0], [-1.0, 0, 0], [0, 0, 1.0]])
TWO_LEVELS = ms.PrintableSet(2.0, INK.directions, levels=(0.5, 1.0))


@pytest.mark.parametrize(
    ("function", "at"),
    [
        (lambda x: objectives.shape_matching(x, 0.5 * VECTORS), VECTORS),
        (lambda x: objectives.shape_matching(x, REST[:2], vertices=[4, 1], weights=[1.0, 3.0]), VECTORS),
        (lambda x: objectives.height_map(x, REST, IMAGE, (0, 1, 0, 1)), VECTORS),
        (
            lambda x: objectives.shape_matching(x, REST[:4].reshape(2, 2, 3), [4, 1], [[1.0, 3], [2, 4]]),
            CASES,
        ),
        (lambda x: objectives.height_map(x, REST, IMAGE, (0, 1, 0, 1), weights=np.arange(6.0)), CASES),
        (lambda x: objectives.extension(x, [0, 3], [(1.0, 2.0, 0.5), (0.0, 0.0, 2.0)]), CASES),
        (lambda image: objectives.bilinear(image, REST, (0, 1, 0, 1)), IMAGE),
        (lambda x: objectives.extension(x, [0, 3], (1.0, 2.0, 0.5)), VECTORS),
        (lambda m: objectives.magnitude(m, areas=REST[:, 0]), VECTORS),
        (lambda m: objectives.total_variation(m, EDGE_FACES, np.arange(1.0, 6.0), smoothing=0.1), VECTORS),
        (lambda y: objectives.total_variation(y, EDGE_FACES), AMPLITUDE),
        (lambda m: objectives.limit(m, 0.8), VECTORS),
        (lambda m: objectives.limit(m, 0.8, sharpness=8), VECTORS),
        (lambda m: objectives.printable(m, INK), VECTORS),
        (lambda m: objectives.printable(m, INK, areas=REST[:, 0], sharpness=3.0), VECTORS),
        (lambda m: objectives.printable(m, TWO_LEVELS), VECTORS),
        (lambda v: parametrize.from_regions(v, [0, 2, 2, 1]), VECTORS[:3]),
        (lambda a: parametrize.along(a, VECTORS), AMPLITUDE),
        (lambda s: parametrize.log_scaled(s, 1.0, 100.0), AMPLITUDE.sigmoid()),
        (lambda y: parametrize.log_shares(y, 1.0, 100.0), AMPLITUDE.exp()),
        (lambda v: parametrize.softly_limited(v, 0.7), VECTORS),
        (lambda v: parametrize.clip_to_limit(v, 1.3), VECTORS),
    ],
)
def test_derivatives_equal_differences(function, at):
    assert gradcheck(function, (at.clone().requires_grad_(),))


@pytest.mark.parametrize(
    "function",
    [
        lambda m: objectives.total_variation(m, EDGE_FACES),
        lambda m: objectives.limit(m, 1e5, sharpness=8).sum(),
        lambda m: objectives.printable(m, INK),
        lambda m: objectives.magnitude(m),
        lambda m: parametrize.softly_limited(m, 1e5).sum(),
        lambda m: parametrize.clip_to_limit(m, 1e5).sum(),
    ],
)
def test_no_magnetization_has_a_finite_gradient(function):
    m = torch.zeros(6, 3, dtype=torch.float64, requires_grad=True)
    value = function(m)
    value.backward()
    assert value.isfinite() and m.grad.isfinite().all()


def test_shape_matching_counts_the_chosen_vertices():
    target = VECTORS[[4, 1]] + torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    assert objectives.shape_matching(VECTORS, target, vertices=[4, 1]).item() == pytest.approx(8)
    assert objectives.shape_matching(
        VECTORS, target.numpy(), [4, 1], weights=[0.5, 0.25]
    ).item() == pytest.approx(3)


@pytest.mark.parametrize(
    "objective",
    [
        lambda x: objectives.shape_matching(x, VECTORS),
        lambda x: objectives.shape_matching(x, REST[:2], vertices=[4, 1], weights=[1.0, 3.0]),
        lambda x: objectives.height_map(x, REST, IMAGE, (0, 1, 0, 1), weights=np.arange(6.0)),
        lambda x: objectives.extension(x, 2, (1.0, 2.0, 0.5)),
    ],
)
def test_load_cases_are_summed(objective):
    assert objective(CASES).item() == pytest.approx(sum(objective(case).item() for case in CASES))


def test_each_load_case_has_its_own_target():
    targets = torch.stack([VECTORS, REST])
    apart = objectives.shape_matching(CASES[0], VECTORS) + objectives.shape_matching(CASES[1], REST)
    assert objectives.shape_matching(CASES, targets).item() == pytest.approx(apart.item())
    directions = [(0.0, 0, 3), (0.0, 2, 0)]
    reach = -CASES[0, 1, 2] - CASES[1, 1, 1]
    assert objectives.extension(CASES, 1, directions).item() == pytest.approx(reach.item())


@pytest.mark.filterwarnings("error")
def test_arrays_that_cannot_be_written_to_are_taken_quietly():
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(2, 2))
    assert not mesh.edge_faces.flags.writeable
    objectives.total_variation(torch.rand(mesh.n_faces), mesh.edge_faces)
    rest = torch.tensor(mesh.rest_positions)
    objectives.shape_matching(rest, mesh.rest_positions)
    objectives.height_map(rest, mesh.rest_positions, IMAGE.numpy(), (0, 1, 0, 1))
    parametrize.from_regions(torch.rand(mesh.n_vertices), mesh.faces[:, 0])


def test_bilinear_is_exact_for_bilinear_images_and_constant_beyond():
    x, y = np.meshgrid(np.linspace(-1, 3, 5), np.linspace(2, 0, 4))  # row 0 at the largest y
    points = np.array([[0.3, 1.1, 9.0], [-1.0, 0.0, 9.0], [3.0, 2.0, 9.0], [7.0, -5.0, 9.0]])
    found = objectives.bilinear(1 + 2 * x - y + x * y, points, (-1, 3, 0, 2))
    inside = np.clip(points, [-1, 0, 0], [3, 2, 9])
    expected = 1 + 2 * inside[:, 0] - inside[:, 1] + inside[:, 0] * inside[:, 1]
    np.testing.assert_allclose(found, expected)


def test_height_map_reads_the_image_where_vertices_rest():
    rest = torch.tensor([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]], dtype=torch.float64)
    now = torch.tensor([[5.0, 5.0, 0.1], [6.0, 6.0, 0.6]], dtype=torch.float64)
    image = [[0.1, 0.2], [0.3, 0.4]]
    assert objectives.height_map(now, rest, image, (0, 1, 0, 1)).item() == pytest.approx(0.04)


def test_extension_does_not_depend_on_the_directions_length():
    positions = torch.tensor([[1.0, 2, 3], [3.0, 2, 1]])
    assert objectives.extension(positions, [0, 1], (0, 0, 7.0)).item() == pytest.approx(-2)
    assert objectives.extension(positions, 0, (0, 0, 7.0)).item() == pytest.approx(-3)


def test_total_variation_of_a_step_is_its_height_times_its_length():
    mesh = ms.meshes.rectangle(1.0, 1.0, cells=(4, 4))
    centers = mesh.rest_positions[mesh.faces].mean(axis=1)
    lengths = np.linalg.norm(np.diff(mesh.rest_positions[mesh.edges], axis=1)[:, 0], axis=1)
    step = torch.tensor(np.where(centers[:, 0] < 0.5 * (centers[:, 0].min() + centers[:, 0].max()), 0.0, 3.0))
    found = objectives.total_variation(step, mesh.edge_faces, lengths, smoothing=1e-9)
    assert found.item() == pytest.approx(3.0)
    assert objectives.total_variation(torch.ones_like(step), mesh.edge_faces, lengths).item() == 0


def test_cap_and_its_aggregate():
    m = torch.tensor([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64) * 1e5
    np.testing.assert_allclose(objectives.limit(m, 5e5), [0.0, -0.96], atol=1e-12)
    aggregate = objectives.limit(m, 4e5, sharpness=20)
    assert aggregate.shape == (1,) and 25 / 16 - 1 <= aggregate.item() < 25 / 16 - 1 + 1e-3
    norms = parametrize.clip_to_limit(m, 4e5).norm(dim=1)
    np.testing.assert_allclose(norms, [4e5, 1e5])
    assert (parametrize.softly_limited(1e3 * m, 4e5).norm(dim=1) <= 4e5).all()


def test_parametrisations_have_known_values():
    assert parametrize.from_regions(torch.tensor([1.0, 5.0]), [1, 0, 1]).tolist() == [5, 1, 5]
    unsigned = np.array([1, 0, 1], dtype=np.uint64)
    assert parametrize.from_regions(torch.tensor([1.0, 5.0]), unsigned).tolist() == [5, 1, 5]
    assert parametrize.along(torch.tensor([2.0, -1.0]), (0, 0, 9.0)).tolist() == [[0, 0, 2], [0, 0, -1]]
    moduli = parametrize.log_scaled(torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64), 1e4, 1e8)
    np.testing.assert_allclose(moduli, [1e4, 1e6, 1e8])
    np.testing.assert_allclose(parametrize.log_shares(moduli, 1e4, 1e8), [0, 0.5, 1], atol=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: objectives.shape_matching(VECTORS, REST[:2]), "target must have shape"),
        (lambda: objectives.shape_matching(VECTORS, REST, weights=[1.0]), "weights must have shape"),
        (lambda: objectives.shape_matching(VECTORS, REST[0]), "target must have shape"),
        (lambda: objectives.shape_matching(CASES, VECTORS[None]), "target must have shape"),
        (lambda: objectives.extension(VECTORS, 0, CASES[:, 0]), "direction must have shape"),
        (lambda: objectives.shape_matching(VECTORS, REST[:1], vertices=[0.5]), "integers"),
        (lambda: objectives.height_map(VECTORS, REST, [1.0, 2.0], (0, 1, 0, 1)), "image must have shape"),
        (lambda: objectives.height_map(VECTORS, REST, [[1.0, 2.0]], (0, 1, 0, 1)), "2 rows"),
        (lambda: objectives.height_map(VECTORS, REST, IMAGE, (1, 0, 0, 1)), "extent"),
        (lambda: objectives.extension(VECTORS, 0, (0.0, 0, 0)), "direction must not be zero"),
        (lambda: objectives.total_variation(VECTORS, EDGE_FACES, smoothing=0), "smoothing"),
        (lambda: objectives.limit(VECTORS, -1.0), "limit"),
        (lambda: objectives.limit(VECTORS, 1.0, sharpness=1), "sharpness"),
        (lambda: objectives.printable(VECTORS, [[1.0, 0, 0]]), "ink must be an ms.PrintableSet, got list"),
        (lambda: objectives.printable(VECTORS, INK, areas=np.zeros(6)), "areas must not be negative"),
        (lambda: parametrize.from_regions(VECTORS, [0, 6]), "regions must lie in 0 ... 5"),
        (lambda: parametrize.along(AMPLITUDE, VECTORS[:2]), "directions must have shape"),
        (lambda: parametrize.log_scaled(AMPLITUDE, 0.0, 1.0), "positive and in order"),
        (lambda: parametrize.softly_limited(VECTORS, math.nan), "limit"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
