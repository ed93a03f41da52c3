"""Two flaps that snap together by their own field and let go in an opening field."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("snapping_flaps")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(step=0.5e-3)


def test_flaps_hold_each_other_only_with_their_own_field(result) -> None:
    own, without = result[True], result[False]
    assert own["without_field"] == pytest.approx(
        7.4e-3, rel=0.02
    )  # they attract each other where they are open too
    assert without["without_field"] == pytest.approx(8e-3, rel=1e-9)
    assert own["closed"] == pytest.approx(0.63e-3, rel=0.05)  # coat on coat
    assert without["closed"] == pytest.approx(8e-3, rel=1e-6)
    assert all(state.stable for one in result.values() for state in one["states"])


def test_an_opening_field_releases_the_flaps(result) -> None:
    own, without = result[True], result[False]
    assert 2e-3 < own["opens_at"] <= 3e-3 and np.isnan(without["opens_at"])
    # released, they are open as far as those without an own field
    assert own["openings"][-1] == pytest.approx(without["openings"][-1], rel=1e-2)


def test_forces_on_both_flaps_are_opposite_and_attract(result) -> None:
    lower, upper = result[True]["force"]
    assert lower[2] > 1e-4
    np.testing.assert_allclose(upper, -lower, rtol=0, atol=1e-9 * lower[2])


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "flaps.png")
    assert (tmp_path / "flaps.png").stat().st_size > 50_000
    assert "with their own field: 7.4" in example.summary(result)
