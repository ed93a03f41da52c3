"""Magnetic beads on a thread, with and without their own field."""

import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("bead_chain")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main()


def test_beads_stiffen_the_thread_across_and_soften_it_along(result) -> None:
    sags = {key: 1e3 * one["sag"] for key, one in result.items()}
    assert sags["across", True] == pytest.approx(14.9, abs=0.3)
    assert sags["along", True] == pytest.approx(21.9, abs=0.3)
    assert sags["along", False] == pytest.approx(19.1, abs=0.3)
    assert sags["across", False] == pytest.approx(sags["along", False], rel=1e-6)
    assert all(one["state"].stable for one in result.values())


def test_energy_of_the_beads_in_the_field_of_each_other(result) -> None:
    assert result["along", True]["energies"]["mutual"] < 0 < result["across", True]["energies"]["mutual"]
    assert result["along", False]["energies"]["mutual"] == 0


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "chain.png")
    assert (tmp_path / "chain.png").stat().st_size > 50_000
    assert "moments across the thread: the tip sags by 1" in example.summary(result)
