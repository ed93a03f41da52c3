"""The page on values: its table has the names that objects have."""

import re
from pathlib import Path

import pytest

import magshell as ms

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "values.md"
MESH = ms.meshes.rectangle(0.04, 0.01, cells=(4, 2))
SHELL = ms.Shell(MESH, thickness=1e-3, young_modulus=1e6)
POINT = (SHELL, (0.02, 0.005, 0.0))
# The names of these depend on how they are made: together they have all.
SAMPLES = {
    "Crease": [ms.Crease(MESH.interior_edges[:1], 1e-5, angle=0.0)],
    "Spring": [
        ms.Spring(POINT, (0, 0, 1.0), stiffness=1.0),
        ms.Spring(POINT, (0, 0, 1.0), stiffness=1.0, damping=1.0),
    ],
    "ElasticFoundation": [ms.ElasticFoundation(1.0, damping=1.0)],
}


def rows() -> dict[str, tuple[set[str], set[str]]]:
    """Return the names of each class on the page, and those that may change in time."""
    found = {}
    for line in PAGE.read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) != 3 or not re.fullmatch(r"`\w+`(, `\w+`)*", cells[0]):
            continue
        names, in_time = (set(re.findall(r"`(\w+)`", cell)) for cell in cells[1:])
        for kind in re.findall(r"`(\w+)`", cells[0]):
            if names:
                found[kind] = (names, in_time)
    return found


@pytest.mark.parametrize("kind", sorted(set(rows()) - {"Solid", "Scene", "Cavity", "Skin"}))
def test_page_names_what_a_solve_can_replace(kind):
    names, in_time = rows()[kind]
    of = SAMPLES.get(kind, [getattr(ms, kind)])
    assert names == {name for each in of for name in each._replaceable}
    assert in_time == {name for each in of for name in each._in_time}


def test_page_lists_most_of_the_classes_with_values():
    assert len(rows()) > 25


def test_page_names_the_values_of_cavities_and_scenes():
    assert rows()["Cavity"][0] == set(ms.Cavity._replaceable)
    assert rows()["Scene"][0] == set(ms.Scene._replaceable)
