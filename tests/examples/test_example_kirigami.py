"""The kirigami tower: a short search's numbers, and its picture."""

import numpy as np
import pytest
from example_modules import load


@pytest.fixture(scope="module")
def tower() -> dict:
    """Run L-BFGS from no magnetization, and a few iterations of MMA."""
    example = load("kirigami_tower")
    searches = [search for search in example.SEARCHES if search.name in ("L-BFGS", "MMA, all faces free")]
    return example.main(searches, iterations=20, trials=6)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_numbers_of_faces_and_variables_are_about_the_papers(tower) -> None:
    assert (tower["faces"], tower["vertices"]) == (234, 199)  # [Chen22] Table 1: 244, 205
    assert [found["variables"] for found in tower["searches"]] == [234, 702]  # and 0.7 k


def test_sheet_hangs_without_magnetization_and_stands_with_it(tower) -> None:
    assert tower["hanging"] == pytest.approx(-11.91e-3, rel=0.01)
    height, check = tower["tower"]["height"], tower["checks"]
    assert height == pytest.approx(33.4e-3, rel=0.02)
    assert 0.75 < height / check["longest_path"] < 1.0
    assert check["stable"] and check["moved"] < 1e-9
    assert check["off_axis"] < 0.2e-3
    assert check["lowest"] > -1.5e-3


def test_both_optimizers_come_as_high(tower) -> None:
    assert tower["searches"][1]["height"] == pytest.approx(tower["tower"]["height"], rel=0.05)


def test_the_field_pays_for_it(tower) -> None:
    check = tower["checks"]
    stored = sum(check["energies"][name] for name in ("membrane", "bending", "gravity"))
    assert check["energies"]["gravity"] > 0
    assert 0 < stored < -check["energies"]["magnetic"] < 1.1 * check["magnetic_at_most"]
    assert check["largest_magnetization"] <= 80e3


def test_tower_rises_from_the_floor_as_the_field_grows(tower) -> None:
    """Include contact with the floor and between rings: penetration stays within the penalty's compliance, no face
    crosses.
    """
    found = tower["checks"]["switched_on"]
    assert found["height"] == pytest.approx(31.9e-3, rel=0.02) and found["stable"]
    assert (np.diff(found["heights"]) > 0).all()
    assert found["lowest"].min() > -0.06e-3 and found["lowest"][-1] > -1e-6
    assert found["crossings"] == 0
    assert found["on_floor"][0] == pytest.approx(
        7.5e-3, rel=0.05
    )  # less than the weight, as the ring is glued


def test_tower_height_is_robust_to_disturbances(tower) -> None:
    check = tower["checks"]
    assert -0.5e-3 < check["disturbed"].min() and check["disturbed"].max() < 0.1e-3


def test_little_is_left_to_gain(tower) -> None:
    gap = tower["checks"]["first_order"]
    assert gap["tower"] < 0.05 * gap["start"]


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning")
def test_pictures_and_summary(tower, tmp_path) -> None:
    example = load("kirigami_tower")
    example.plot(tower).savefig(tmp_path / "tower.png")
    assert (tmp_path / "tower.png").stat().st_size > 100_000
    assert "L-BFGS" in example.summary(tower)
