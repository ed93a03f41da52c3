"""The pneumatic finger: pressure against bending angle, and the same finger full of air."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("pneumatic_finger")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main()


def test_finger_bends_away_from_its_channel_progressively(result, example) -> None:
    angles, pressures = result["angles"], result["pressures"]
    assert pressures[0] == 0.0 and pressures[-1] == pytest.approx(example.PRESSURE)
    assert (np.diff(angles) > 0).all() and (np.diff(result["volumes"]) > 0).all()
    half = np.interp(0.5 * example.PRESSURE, pressures, angles)
    assert 0.1 * angles[-1] < half < 0.25 * angles[-1]
    assert 6.0 < np.degrees(angles[-1]) < 7.0


def test_air_that_is_let_in_presses_with_what_its_room_leaves(result, example) -> None:
    air, rest = result["air"], result["volumes"][0]
    assert air["pressure"] == pytest.approx(example.FILLED * rest / air["volume"] - 101325.0, rel=1e-9)
    # On the curve of the pressure prescribed, between two of its points.
    assert air["angle"] == pytest.approx(
        np.interp(air["pressure"], result["pressures"], result["angles"]), rel=0.02
    )


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.write(result, tmp_path)
    assert (tmp_path / "pneumatic_finger.png").stat().st_size > 20_000
    assert "at 14 kPa" in example.summary(result)
