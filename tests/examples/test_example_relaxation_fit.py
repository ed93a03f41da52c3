"""The fit of a relaxation test on a coarser mesh: its error, its parameters, and what is needed for them."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def relaxed() -> dict:
    return load("relaxation_fit").main(cells=(2, 1, 1))


@pytest.mark.filterwarnings("ignore::magshell.MeshQualityWarning")
def test_measured_force_is_fitted_by_two_branches(relaxed) -> None:
    assert relaxed["rms"][2] < 1.5e-3
    assert 4e-3 < relaxed["rms"][1] < 1e-2
    assert relaxed["fits"][2].minimum.reason == "the objective has settled"


def test_branches_equal_those_of_the_finer_mesh(relaxed) -> None:
    values = relaxed["fits"][2].values
    assert values["modulus"] == pytest.approx(309e3, rel=0.05)
    np.testing.assert_allclose(values["moduli"], (0.113, 0.040), rtol=0.05)
    np.testing.assert_allclose(values["times"], (4.5, 68.0), rtol=0.05)


def test_sudden_pull_gives_another_fast_branch(relaxed) -> None:
    fast, slow = relaxed["sudden"].values["moduli"] / relaxed["fits"][2].values["moduli"]
    assert fast < 0.4 and 1.1 < slow < 1.3
    assert relaxed["steps"] < 1e-4
    assert relaxed["move"].positions[-1, :, 0].max() == pytest.approx(52e-3)


def test_plot_draws_forces_and_residuals(relaxed) -> None:
    assert len(load("relaxation_fit").plot(relaxed).axes) == 2
