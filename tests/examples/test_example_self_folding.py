"""A strip that stays folded by its own field."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("self_folding")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(opening=6)


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_the_own_field_holds_the_fold_when_the_field_ends(result) -> None:
    own, without = result[True], result[False]
    for one in result.values():
        assert one["folded_in_field"] == pytest.approx(170, abs=3)
        assert all(state.stable for state in one["states"])
    assert own["without_field"] == pytest.approx(180, abs=3)
    assert without["without_field"] == pytest.approx(0, abs=1e-3)
    assert own["energies"]["own"] < 0


def test_a_field_upwards_opens_the_fold(result) -> None:
    own, without = result[True], result[False]
    assert 5e-3 < own["opens_at"] <= 10e-3 and np.isnan(without["opens_at"])
    assert own["angles"][-1] == pytest.approx(without["angles"][-1], abs=2)


@pytest.mark.filterwarnings("ignore::magshell.FieldSamplingWarning")
def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "fold.png")
    assert (tmp_path / "fold.png").stat().st_size > 50_000
    assert "180 without; opens at" in example.summary(result)
