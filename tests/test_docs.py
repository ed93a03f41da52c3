"""What docs/ says about files is true."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_a_page_names_are_there(page):
    named = re.findall(r"`((?:cpp|python|tests|examples|notebooks)/[\w./]+)`", page.read_text())
    assert named
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_line_that_adds_surface_tension_is_there():
    page = (ROOT / "docs" / "adding-an-energy.md").read_text()
    line = re.search(r"one line: `(.*)`", page).group(1)
    assert line in (ROOT / "cpp" / "bindings" / "face_energies.cpp").read_text()
