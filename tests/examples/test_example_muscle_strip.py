"""The strip with two muscles: bends as a bilayer, swims with its wave, and its pictures."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("muscle_strip")


@pytest.fixture(scope="module")
def strip(example) -> dict:
    return example.main(cells=(12, 2, 2), steps=60, time_step=2e-2)


def test_strip_bends_as_timoshenkos_bilayer(strip) -> None:
    bent = strip["bent"]
    assert bent["curvature"] == pytest.approx(bent["theory"], rel=0.02)
    assert bent["rest"].stable


def test_strip_swims_against_its_wave(strip) -> None:
    swims, backwards = strip["swims"], strip["backwards"]
    assert swims["advance"] > 0.05
    assert backwards["advance"] < -0.05
    assert swims["advance"] == pytest.approx(-backwards["advance"], rel=0.2)
    assert np.abs(swims["center"][:, 1]).max() < 1e-3


def test_picture_is_written(example, strip, tmp_path) -> None:
    figure = example.plot(strip)
    figure.savefig(tmp_path / "strip.png", dpi=40)
    assert (tmp_path / "strip.png").stat().st_size > 5000
