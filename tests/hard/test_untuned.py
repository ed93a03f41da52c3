"""Scenes that no solver was tuned on: their numbers are drawn again as they were, and the table compares runs."""

import pytest
from untuned import table
from untuned_scenes import COUNTED, FAMILIES, SCENES, SEED, all_named, counted, drawn

import magshell as ms


@pytest.mark.parametrize("family", FAMILIES)
def test_a_seed_gives_the_same_twenty_scenes_and_another_seed_others(family):
    scenes = drawn(family)
    assert len(scenes) == SCENES == 20
    assert scenes == drawn(family)
    assert len({str(numbers) for numbers in scenes}) == SCENES
    others = drawn(family, SEED + 1)
    assert all(here != there for here, there in zip(scenes, others, strict=True))


def test_drawn_numbers_stay_those_of_the_baseline():
    """Counts of different commits compare only where the scenes are the same."""
    first = drawn("A6")[0]
    assert first == {"cells": (9, 13), "nu": 0.2059, "thickness": 0.5542, "half": 93.16, "load": 7.646}
    assert drawn("snaps")[5]["kind"] == "truss and back"


def test_families_share_no_scene():
    names = [name for name, _ in all_named()]
    assert len(set(names)) == SCENES * len(FAMILIES)
    assert drawn("C1 30 to 90") != drawn("C1 120 to 170")


def test_five_scenes_of_each_family_are_counted():
    assert list(COUNTED) == list(FAMILIES)
    assert all(len(set(numbers)) == 5 for numbers in COUNTED.values())
    assert len(list(counted())) == 5 * len(FAMILIES)


@pytest.mark.filterwarnings("ignore::magshell.LargeStrainWarning", "ignore::magshell.MeshQualityWarning")
@pytest.mark.parametrize("family", FAMILIES)
def test_fastest_scene_of_a_family_is_right(family):
    name = f"{family}/{COUNTED[family][0]:02d}"
    assert dict(all_named())[name]() is True


def test_a_wrong_end_is_told(monkeypatch):
    solve = ms.equilibrium
    monkeypatch.setattr(ms, "equilibrium", lambda *args, **load_parameters: solve(*args, load_factor=0.5))
    numbers = COUNTED["rolled"]
    assert "end x, z" in dict(all_named())[f"rolled/{numbers[0]:02d}"]()


def test_table_sums_a_family_and_leaves_failed_cases_out_of_the_mean():
    def row(factorizations, energy=1.0, **more):
        call = {"factorizations": factorizations, "iterations": 2 * factorizations, "energy": energy, **more}
        return {"right": not more, "seconds": 0.5, "calls": [call]}

    found = {"A6/00": row(10, 2.0), "A6/01": row(20), "A6/02": row(500, failed="stopped")}
    earlier = {"A6/00": row(12, 1.0), "A6/01": row(20)}
    tuned = {"A6/8x8/300": row(5), "C1/30/10x1/2": row(99)}
    cells = table(found, earlier, tuned).splitlines()[1].split()
    assert cells[:8] == ["A6", "3", "530", "1060", "500", "1", "1", "1.5"]
    assert cells[8:11] == ["15.0", "5.0", "3.00"]
    assert cells[11:] == ["32", "64", "20", "1", "0", "+0.5"]
