"""Tests of the bridges: the moduli found for the suspension bridge, and their identifiability."""

import numpy as np
import pytest
from example_modules import load

pytestmark = pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")


@pytest.fixture(scope="module")
def bridges() -> dict:
    return load("bridges").main(bridges=("suspension",), every=12)


@pytest.fixture(scope="module")
def task():
    load("bridges")
    from _bridges.shape import arch, suspension
    from _bridges.task import Task

    return {"suspension": Task(suspension()), "arch": Task(arch())}


def test_meshes_of_about_the_papers_sizes(task) -> None:
    for name, size, n in (
        ("suspension", (0.58, 0.16, 0.28), 668),
        ("arch", (0.74, 0.19, 0.36), 2911),
    ):
        bridge = task[name].bridge
        np.testing.assert_allclose(np.ptp(bridge.mesh.rest_positions, axis=0), size, rtol=0.02)
        assert bridge.mesh.n_tetrahedra == pytest.approx(n, rel=0.03)
        assert bridge.mesh.n_components == 1
    assert len(task["arch"].bridge.held) == pytest.approx(115, abs=15)


def test_the_gradient_reaches_the_sag_in_few_iterations(bridges) -> None:
    [found] = bridges["searches"]
    assert found.errors[0] > 0.3 and found.errors[-1] < 0.01
    assert found.iterations <= 10 and found.simulations[-1] <= 15
    low, high = found.task.bounds
    assert len(found.unknowns) == 1332 and (low <= found.unknowns).all() and (found.unknowns <= high).all()
    assert found.task.distance(found.task.motion(found.unknowns)) < 8e-4


def test_both_moduli_of_every_tetrahedron_are_live(bridges) -> None:
    [found] = bridges["searches"]
    changed = np.abs(found.unknowns - found.task.start) > 0
    assert changed.mean() > 0.99


def test_the_slope_is_that_of_differences_over_all_steps(bridges, task) -> None:
    assert bridges["slopes"]["suspension"] < 1e-4
    assert load("bridges").slope_error(task["arch"]) < 1e-4


def test_single_measurement_determines_one_combination_of_moduli(bridges) -> None:
    sag, surface, turned, precise = bridges["known"]
    assert (sag.numbers, sag.directions) == (1, 1)
    assert sag.of("young_modulus").mean() > 0.999 and sag.identified("young_modulus") == 0
    assert 1 < surface.directions < turned.directions < precise.directions <= precise.numbers
    for before, after in ((sag, surface), (surface, turned), (turned, precise)):
        assert after.of("young_modulus").mean() < before.of("young_modulus").mean()
    for each in bridges["known"]:  # stiffness is seen better than how it bulges
        assert each.of("poisson_ratio").mean() > each.of("young_modulus").mean()


def test_posterior_deviation_is_that_of_the_normal_equations(bridges, task) -> None:
    """Compare with the posterior covariance from the normal equations."""
    load("bridges")
    from _bridges.identified import PRIOR_LOG, PRIOR_POISSON, _known

    n = 6
    rows = np.random.default_rng(0).normal(size=(4, 2 * n)) * 1e-3
    prior = np.repeat((PRIOR_LOG, PRIOR_POISSON), n)
    left = np.sqrt(np.diag(np.linalg.inv(rows.T @ rows / 1e-4**2 + np.diag(prior**-2.0)))) / prior
    np.testing.assert_allclose(_known("any", rows, 1e-4).left, left, rtol=1e-9)


def test_pictures_of_the_bridges(bridges, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("MAGSHELL_PLOT", "matplotlib")
    example = load("bridges")
    assert len(example.plot(bridges).axes) == 2
    [found] = bridges["searches"]
    assert example.picture(found)._repr_png_().startswith(b"\x89PNG")
    options = {"fps": 3.0, "width": 400, "progress": False}
    assert example.movie(found, tmp_path / "a.gif", **options).stat().st_size > 5_000
    assert "within 1 % after" in example.summary(bridges)
