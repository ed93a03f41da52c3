"""The tendon arm: one tendon against beam theory."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("tendon_arm")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main()


def test_single_tendon_bends_the_arm_as_beam_theory(result) -> None:
    assert np.allclose(result["angles"], result["theory"], rtol=0.03, atol=1e-9)
    assert result["angles"][-1] > np.radians(3)


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.write(result, tmp_path)
    assert (tmp_path / "tendon_arm.png").stat().st_size > 20_000
    assert "beam theory" in example.summary(result)
