"""The example of the taper that makes a magnetized strip an arc, on 160 faces."""

import numpy as np
import pytest
from example_modules import load

example = load("tapered_arc")


@pytest.fixture(scope="module")
def result() -> dict:
    return example.main(cells=(40, 2))


def test_taper_found_by_gradient_is_that_of_the_closed_form_within_a_percent(result) -> None:
    assert result["error"] < 0.01
    assert result["expected"][-1] < 0.35 * result["expected"][0]
    np.testing.assert_allclose(result["widths"], result["expected"], rtol=0.01)


def test_tapered_strip_is_an_arc_and_the_rectangle_is_not(result) -> None:
    before, after = result["distances"]
    assert before > 0.2 * example.LENGTH
    assert after < 2e-4 * example.LENGTH
    assert result["evaluations"] <= 12


def test_closed_form_obeys_the_balance_of_moments() -> None:
    """Compare the change of the bending moment along the arc with the torque of the field."""
    s = np.linspace(0.0, example.LENGTH, 2001)
    width = example.closed_form(s)
    moment = example.YOUNG_MODULUS * example.THICKNESS**3 * width * example.CURVATURE / 12.0
    torque = example.MAGNETIZATION * example.FLUX_DENSITY * example.THICKNESS * width
    torque *= np.cos(example.CURVATURE * s)
    change = np.gradient(moment, s, edge_order=2)
    np.testing.assert_allclose(change, -torque, atol=1e-5 * torque.max())
    assert moment[-1] == pytest.approx(example.COUPLE * width[-1], rel=1e-12)


def test_tapered_arc_pictures_are_written(result, tmp_path) -> None:
    example.write(result, tmp_path)
    assert [path.name for path in tmp_path.glob("*.png")] == ["tapered_arc.png"]
    assert "of the width" in example.summary(result)
