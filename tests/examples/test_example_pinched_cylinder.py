"""Example pinched_cylinder: refined meshes are right to 0.1 % with a fraction of the unknowns of even ones."""

import numpy as np
import pytest
from example_modules import load

pytest.importorskip("torch")


@pytest.fixture(scope="module")
def result() -> dict:
    return load("pinched_cylinder").main(
        cylinder=((6, 6), (8, 8), (16, 16)), hemisphere=((8, 8), (8, 8), (16, 16))
    )


@pytest.mark.parametrize("name", ["pinched cylinder", "pulled hemisphere"])
def test_refined_meshes_meet_the_tolerance_with_a_third_of_the_unknowns(result, name) -> None:
    of = result["cases"][name]
    assert abs(of["errors"][-1]) < 1.25 * result["tolerance"]
    assert np.abs(of["even errors"]).min() > 1.25 * result["tolerance"]
    assert 3 * of["unknowns"][-1] < of["even unknowns at the tolerance"]


@pytest.mark.parametrize("name", ["pinched cylinder", "pulled hemisphere"])
def test_estimates_agree_with_the_errors_below_five_percent(result, name) -> None:
    of = result["cases"][name]
    small = (np.abs(of["errors"]) < 0.05) & (np.abs(of["errors"]) > 1e-3)
    assert small.any()
    effectivities = of["estimates"][small] / of["errors"][small]
    assert np.all((effectivities > 0.8) & (effectivities < 1.25))


def test_pictures_and_summary_of_the_refined_meshes_are_drawn(result, monkeypatch) -> None:
    example = load("pinched_cylinder")
    assert len(example.plot(result).axes) == 2
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    assert example.picture(result)._repr_png_().startswith(b"\x89PNG")
    assert "even meshes need about" in example.summary(result)
