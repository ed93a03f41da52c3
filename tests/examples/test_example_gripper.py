"""The gripper: the search through contact lays the arms around the ball, and then they lift it."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def example():
    return load("gripper")


@pytest.fixture(scope="module")
def result(example) -> dict:
    return example.main(iterations=4, steps=120)


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_the_search_closes_the_arms(result, example) -> None:
    design = result["design"]
    assert design["objective"] < 0.2 * design["history"][0]
    assert np.abs(design["remanent_magnetization"]).max() <= example.LIMIT


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_six_printable_directions_meet_the_target(example, result) -> None:
    """Check that the rounded design, every face fully magnetized along an axis, is within 0.3 mm of the target."""
    printed = result["printed"]
    assert printed.objective**0.5 < 0.3  # mm rms
    assert printed.not_printable == 0
    m = np.sort(np.abs(printed.remanent_magnetization.numpy()), axis=1)
    np.testing.assert_allclose(m, np.tile([0, 0, example.LIMIT], (len(m), 1)), atol=1e-6)
    again = example.Mismatch(result["gripper"])(printed.remanent_magnetization)  # from the rest shape
    assert again.item() ** 0.5 < 0.3


def test_ball_is_lifted_by_what_was_found_only(result) -> None:
    raised = {
        name: result[name]["ball_height"][-1] - result[name]["ball_height"][0]
        for name in ("lift", "lift_printed", "without")
    }
    assert raised["lift"] > 18e-3
    assert raised["lift_printed"] > 18e-3
    assert raised["without"] < 1e-3


def test_no_face_crosses_another(result) -> None:
    for name in ("lift", "lift_printed", "without"):
        assert result[name]["crossings"] == 0
        assert result[name]["gaps"].min() > result[name]["least_gap"]
    assert result["lift"]["forces"].max() > 4.3e-3  # N: more than the ball's weight


@pytest.mark.filterwarnings("ignore::magshell.StepErrorWarning")
def test_arms_of_18_mm_touch_without_crossing(example, monkeypatch) -> None:
    """Use arms of 18 mm, whose ends curl under the ball; without self-contact of the sheet hundreds of faces cross."""
    import sys

    model, lift = (sys.modules[f"_gripper.{name}"] for name in ("model", "lift"))
    monkeypatch.setattr(model, "ARM", 18e-3)
    gripper = model.Gripper(1.5e-3)
    outer = np.abs(gripper.mesh.face_barycenters[:, :2]).max(axis=1) >= 11e-3
    share = np.where(outer[:, None], [0, 0, 0.9], 0.9 * gripper.outwards)
    found = lift.closing_and_lift(gripper, model.LIMIT * share, 60)
    own = gripper.lifting.contacts[2]
    assert found["crossings"] == 0
    assert max(len(found["motion"].contact_state(own, k).pairs) for k in range(61)) > 10


def test_picture_and_summary(example, result, tmp_path) -> None:
    example.plot(result).savefig(tmp_path / "gripper.png")
    assert (tmp_path / "gripper.png").stat().st_size > 50_000
    assert "288 faces" in example.summary(result)
