"""The kirigami reaching targets: a short search's numbers, and its picture."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def reaching() -> dict:
    """Run the example with two targets, each active for 0.6 s and counting after 0.4 s."""
    return load("kirigami_reaching").main(targets=2, each=0.6, delay=0.4, iterations=6)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.StepErrorWarning")
def test_center_comes_within_1_mm_of_each_target(reaching) -> None:
    start, found = reaching["start"], reaching["found"]
    assert start["rms"] > 1e-3
    assert found["rms"] < 0.25 * start["rms"]
    assert (found["after"] < 1e-3).all()
    assert found["sum_of_squares"] < 0.1 * start["sum_of_squares"]


def test_the_field_stays_within_its_limit(reaching) -> None:
    assert np.abs(reaching["found"]["field"]).max() <= 50e-3
    assert (np.linalg.norm(reaching["found"]["field"], axis=1) > 5e-3).all()


def test_distances_are_those_of_the_objective(reaching) -> None:
    """Compute the distances again from positions, without the search."""
    best = min(record.terms["distance"] for record in reaching["history"])
    assert reaching["found"]["rms"] ** 2 == pytest.approx(best, rel=1e-6)


def test_rms_stays_below_1_mm_with_smaller_steps(reaching) -> None:
    assert reaching["finer"]["rms"] < 1e-3


def test_a_field_that_points_to_the_target_does_so(reaching) -> None:
    times = reaching["times"][1:]
    settled = (times % reaching["each"]) > 0.45
    assert np.degrees(reaching["start"]["angles"][settled]).max() < 5.0


def test_each_cell_has_three_variables(reaching) -> None:
    assert reaching["variables"] == 3 * 13


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.StepErrorWarning")
def test_pictures_and_summary(reaching, tmp_path) -> None:
    example = load("kirigami_reaching")
    example.plot(reaching).savefig(tmp_path / "reaching.png")
    assert (tmp_path / "reaching.png").stat().st_size > 100_000
    assert "iterations" in example.summary(reaching)
