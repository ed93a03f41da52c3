"""The pendulum in jelly: it swings as its modes say, a little slower than a stiff bar, and its bones stay as long."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("pendulum_in_jelly")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(cells=6)


def test_small_swings_are_those_of_the_first_mode(result) -> None:
    assert result["modes"][0] == pytest.approx(1.0966, rel=1e-3)
    assert result["swung"] == pytest.approx(result["modes"][0], rel=2e-3)
    assert 0.97 < result["swung"] / result["stiff"] < 0.995


def test_bones_keep_their_lengths_and_the_elbow_bends(result) -> None:
    assert result["link_length_error"] < 1e-12
    assert 0.4 < result["elbow"] < 0.7


def test_energy_is_not_gained(result) -> None:
    assert result["energy_gained"] < 1e-6
    assert 0.0 <= result["energy_lost"] < 2e-3


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "jelly.png")
    assert (tmp_path / "jelly.png").stat().st_size > 30_000
    assert "144 tetrahedra" in example.summary(result)
    assert np.isfinite(result["motion"].positions).all()
