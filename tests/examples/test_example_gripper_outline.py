"""The example of an arm of a gripper, whose outline and magnetization are found together, on 156 faces."""

import numpy as np
import pytest
from example_modules import load

pytest.importorskip("gmsh")
example = load("gripper_outline")


@pytest.fixture(scope="module")
def designs() -> dict:
    return example.main(size=1.3e-3, solves=12)["designs"]


def test_outline_and_magnetization_together_close_further_than_each_alone(designs) -> None:
    heights = {name: 1e3 * design["height"] for name, design in designs.items()}
    assert heights["straight"] == pytest.approx(-10.50, abs=0.05)
    assert heights["outline alone"] < heights["straight"] - 2.5
    assert heights["magnetization alone"] < heights["straight"] - 2.5
    assert heights["both"] < min(heights["outline alone"], heights["magnetization alone"]) - 1.0


def test_searches_of_the_arm_take_the_same_number_of_solves(designs) -> None:
    assert {len(designs[name]["heights"]) for name in ("outline alone", "magnetization alone", "both")} == {
        12
    }
    starts = [design["heights"][0] for name, design in designs.items() if name != "straight"]
    np.testing.assert_array_equal(starts, starts[0])


def test_designed_arms_keep_the_area_of_the_straight_one(designs) -> None:
    for design in designs.values():
        assert design["area"] < (1.0 + 1e-4) * design["most_area"]
        assert design["mesh"].face_areas.sum() == pytest.approx(design["area"], rel=1e-6)
    assert designs["both"]["n_meshes"] > 1


def test_height_of_the_designed_arm_is_that_of_a_solve_on_a_finer_mesh(designs) -> None:
    design = designs["both"]
    arm = example.Arm(0.7e-3)
    torch = example.torch
    with torch.no_grad():
        rest = arm.closed(torch.tensor(design["widths"]), torch.tensor(design["angles"]))
        assert float(arm.height(rest)) == pytest.approx(design["height"], rel=0.02)


def test_gripper_outline_pictures_are_written(designs, tmp_path) -> None:
    result = {"designs": designs}
    example.write(result, tmp_path)
    assert (tmp_path / "gripper_outline.png").exists()
    assert len(list(tmp_path.glob("gripper_outline_*_after.png"))) == len(designs["both"]["meshes"]) > 0
    assert "magnetization alone" in example.summary(result)
