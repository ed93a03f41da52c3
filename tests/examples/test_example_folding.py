"""The strips that touch themselves: folded flat and opened again, and coiled up."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("folding")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return {
        "fold": example.measured(example.folding(28, 8)),
        "coil": example.measured(example.coiling(40, 12)),
    }


def test_no_face_crosses_another(result) -> None:
    for each in result.values():
        assert each["crossings"] == 0 and each["pairs"].max() > 10
        assert each["gaps"].min() > each["least_gap"]
        assert each["strain"] < 0.2  # what the model is for


def test_strip_folds_flat_and_opens_again(result) -> None:
    fold = result["fold"]
    folded = int(np.argmax(fold["angles"]))
    assert np.ptp(fold["turned"][: folded + 1]) == pytest.approx(180, abs=4)
    assert fold["end_heights"][folded] > 0.15e-3  # on the leaf, whose middle surface lies at -0.2 mm
    assert fold["end_tops"][folded] < 1e-3
    assert fold["forces"][folded] > 0.3e-3
    np.testing.assert_allclose(fold["positions"][-1], fold["positions"][0], atol=1e-9)


def test_searches_end_soon(result) -> None:
    """Bound the iterations: 310 and 804; step halving to a tenth without growing back took 1072 and 4540."""
    assert result["fold"]["iterations"].sum() < 600
    assert result["coil"]["iterations"].sum() < 1600


def test_strip_coils_up(result) -> None:
    coil = result["coil"]
    assert np.ptp(coil["turned"]) > 640
    assert coil["forces"][0] == 0 and coil["forces"][-1] > 1e-4


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "folding.png")
    assert (tmp_path / "folding.png").stat().st_size > 50_000
    assert "0 faces pass" in example.summary(result)
