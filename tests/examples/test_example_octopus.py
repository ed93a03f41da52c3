"""The swimming octopus: the beginning of its way through a pipe, gradients of its objective, and its picture."""

import numpy as np
import pytest
import torch
from example_modules import load

import magshell as ms


@pytest.fixture(scope="module")
def example():
    return load("octopus")


@pytest.fixture(scope="module")
def swim(example) -> dict:
    """Run the first 0.25 s in the narrow pipe, with a goal 4 mm ahead, from a start with noise."""
    return example.main(channels=("pipe I",), steps=250, goal=1.5e-3, noise=1e-12)["pipe I"]


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_the_mesh_is_as_large_as_the_papers(swim) -> None:
    body = swim["body"]
    assert (body.mesh.n_faces, body.mesh.n_vertices) == (492, 313)
    assert np.bincount(body.tentacle + 1).tolist() == [144] + [58] * 6
    strengths = np.linalg.norm(body.remanent_magnetization, axis=1)
    assert strengths[body.tentacle < 0].max() == 0
    assert np.ptp(strengths[body.tentacle >= 0]) < 1e-9 * strengths.max()


def test_octopus_reaches_its_goal_from_zero_field(swim) -> None:
    center = swim["found"]["center"]
    assert swim["search"].reached == 250 and not swim["search"].failures
    assert center[-1, 0] > swim["path"][-1] - 1e-3
    assert np.abs(center[:, 1:]).max() < 1e-4  # straight on


def test_single_motion_reproduces_that_of_the_search(swim) -> None:
    assert np.array_equal(swim["found"]["positions"][-1], swim["search"].state.positions[-1])


def test_without_gradients_plans_are_only_tried(example) -> None:
    swim = example.Swim.of(example.CHANNELS["pipe I"], 40, gradients=False)
    asked, objective = [], swim.objective
    swim.objective = lambda field, *rest: asked.append(field.requires_grad) or objective(field, *rest)
    found = swim.solve()
    assert found.trials == len(asked) == 11 and not any(asked)
    assert found.reached == 40 and found.evaluations == 0 and found.controls[:, 0].any()


def test_octopus_stays_in_the_pipe_and_the_field_in_its_limit(swim) -> None:
    assert swim["found"]["deepest"] < 1e-4
    assert np.abs(swim["found"]["field"]).max() <= 50e-3


def test_the_gradient_is_that_of_differences(example) -> None:
    """Compare for values of a field in time that also pushes the octopus aside."""
    swim = example.Swim.of(example.CHANNELS["pipe I"], 40)
    swim.goal, swim.precision = 5e-3, 1e-11
    random = np.random.default_rng(1).standard_normal((40, 3))
    field = torch.tensor(5 * swim.swing() + 2e-3 * random, requires_grad=True)
    horizon = ms.control.Horizon(0, 40, 40)
    sum(swim.objective(field, horizon, None).values()).backward()
    for index in ((5, 0), (20, 1), (33, 2)):
        values = []
        for sign in (1, -1):
            moved = field.detach().clone()
            moved[index] += sign * 1e-4
            values.append(float(sum(swim.objective(moved, horizon, None).values())))
        slope = (values[0] - values[1]) / 2e-4
        assert field.grad[index].item() == pytest.approx(slope, rel=1e-4)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_picture_and_summary(example, swim, tmp_path) -> None:
    figure = example.plot({"pipe I": swim})
    figure.savefig(tmp_path / "octopus.png")
    assert (tmp_path / "octopus.png").stat().st_size > 50_000
    assert "does not pass" in example.summary({"pipe I": swim})
