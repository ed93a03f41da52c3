"""The beam designed to snap at given fields, on 192 faces."""

import numpy as np
import pytest
from example_modules import load

example = load("snap_design")


@pytest.fixture(scope="module")
def result() -> dict:
    return example.main(cells=(24, 4))


def test_snap_fields_are_met_in_ten_paths(result) -> None:
    np.testing.assert_allclose(result["fields"][-1], (8.00e-3, -5.00e-3), rtol=0.0, atol=0.01e-3)
    assert len(result["fields"]) <= 10
    np.testing.assert_allclose(result["fields"][0], (5.08e-3, -5.38e-3), rtol=0.01)


def test_equilibria_beside_the_designed_fields_stay_and_snap(result) -> None:
    assert [row["snapped"] for row in result["tried"]] == [False, True, False, True]


def test_gradients_of_snap_fields_agree_with_differences_of_paths(result) -> None:
    beam, design = result["beam"], result["designs"][-1]
    along = np.array([0.3, -0.4, 0.5, 0.05])
    step = 1e-3

    def fields(length):
        return beam.snaps(example.torch.tensor(design + length * along)).fields().numpy()

    slope = (8 * (fields(step) - fields(-step)) - (fields(2 * step) - fields(-2 * step))) / (12 * step)
    np.testing.assert_allclose(result["gradient"] @ along, slope, rtol=1e-5)


def test_search_converges_quadratically(result) -> None:
    misses = 1e3 * np.abs(result["fields"] - result["targets"]).max(axis=1)  # mT
    assert misses[-1] < misses[-2] ** 2 < 0.1


def test_snap_design_pictures(result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 20_000
    assert "snaps through at" in example.summary(result)
