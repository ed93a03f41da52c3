"""The swimming octopus: a short search in a pipe, gradients of its objective, and its picture."""

import numpy as np
import pytest
import torch
from test_examples import load


@pytest.fixture(scope="module")
def example():
    return load("octopus")


@pytest.fixture(scope="module")
def swim(example) -> dict:
    """The first 0.31 s in the narrow pipe, asked to be 15 mm further by then."""
    return example.main(channels=("pipe I",), steps=310, iterations=1, goal=12e-3)["pipe I"]


def test_the_mesh_is_as_large_as_the_papers(swim) -> None:
    body = swim["body"]
    assert (body.mesh.n_faces, body.mesh.n_vertices) == (492, 313)
    assert np.bincount(body.tentacle + 1).tolist() == [144] + [58] * 6
    strengths = np.linalg.norm(body.remanent_magnetization, axis=1)
    assert strengths[body.tentacle < 0].max() == 0
    assert np.ptp(strengths[body.tentacle >= 0]) < 1e-9 * strengths.max()


def test_the_search_lowers_the_objective(swim) -> None:
    first, *_, last = swim["history"]
    assert last.objective < 0.97 * first.objective
    assert last.terms["distance"] < 0.97 * first.terms["distance"]


def test_it_swims_forward(swim) -> None:
    center = swim["found"]["center"]
    assert center[-1, 0] > center[0, 0] + 1e-3
    assert center[-1, 0] > swim["guess"]["center"][-1, 0]
    assert np.abs(center[:, 1:]).max() < 1e-6  # straight on: nothing pushes it aside


def test_it_stays_in_the_pipe_and_the_field_in_its_limit(swim) -> None:
    assert swim["found"]["deepest"] < 1e-4
    assert np.abs(swim["found"]["field"]).max() <= 50e-3


def test_the_gradient_is_that_of_differences(example) -> None:
    """By values of the field in time that push the octopus aside too, and by what describes the oscillations."""
    swim = example.Swim.of(example.CHANNELS["pipe I"], 40)
    swim.goal, swim.precision = 5e-3, 1e-11
    guess = swim.guess()
    rest = 2e-3 * torch.tensor(np.random.default_rng(1).standard_normal((40, 3)))
    variables = [each.requires_grad_() for each in guess._replace(rest=rest, sines=5 * guess.sines)]
    sum(swim.objective(example.Variables(*variables)).values()).backward()
    for which, index, step in ((0, (5, 0), 1e-4), (0, (20, 1), 1e-4), (1, (1,), 1e-2), (3, (1, 0), 1e-5)):
        values = []
        for sign in (1, -1):
            moved = [each.detach().clone() for each in variables]
            moved[which][index] += sign * step
            values.append(float(sum(swim.objective(example.Variables(*moved)).values())))
        slope = (values[0] - values[1]) / (2 * step)
        assert variables[which].grad[index].item() == pytest.approx(slope, rel=1e-4)


def test_picture_and_summary(example, swim, tmp_path) -> None:
    figure = example.plot({"pipe I": swim})
    figure.savefig(tmp_path / "octopus.png")
    assert (tmp_path / "octopus.png").stat().st_size > 50_000
    assert "does not pass" in example.summary({"pipe I": swim})
