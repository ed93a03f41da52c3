"""The gripper: the search through contact lays the arms around the ball, and then they lift it."""

import numpy as np
import pytest
from test_examples import load


@pytest.fixture(scope="module")
def example():
    return load("gripper")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(iterations=4, steps=120)


def test_the_search_closes_the_arms(result, example) -> None:
    design = result["design"]
    assert design["objective"] < 0.2 * design["history"][0]
    assert np.abs(design["remanent_magnetization"]).max() <= example.LIMIT


def test_ball_is_lifted_by_what_was_found_only(result) -> None:
    raised = {
        name: result[name]["ball_height"][-1] - result[name]["ball_height"][0] for name in ("lift", "without")
    }
    assert raised["lift"] > 18e-3
    assert raised["without"] < 1e-3


def test_nothing_passes(result) -> None:
    for name in ("lift", "without"):
        assert result[name]["crossings"] == 0
        assert result[name]["gaps"].min() > result[name]["least_gap"]
    assert result["lift"]["forces"].max() > 4.3e-3  # N: more than the ball's weight


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "gripper.png")
    assert (tmp_path / "gripper.png").stat().st_size > 50_000
    assert "288 faces" in example.summary(result)
